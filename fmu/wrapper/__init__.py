"""The FMI functions in C, on the model of `fmu.model`."""
