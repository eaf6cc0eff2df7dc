"""What a set says of rows that it was not fitted to: exact refits, the gap held out, sizes."""
