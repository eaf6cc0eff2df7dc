"""FMUs as others run them: written from a result, replayed beside a record, driven as a vehicle."""
