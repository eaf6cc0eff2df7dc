"""What the remainder depends on: laws found from the data, where no name of the library fits."""
