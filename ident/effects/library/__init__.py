"""The effects, one module each; every module here is found and listed."""
