"""The effects that the emulator injects, one module each; every module here is found and listed."""
