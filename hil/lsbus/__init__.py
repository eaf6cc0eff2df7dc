"""FMI-LS-BUS: the emulated devices written as C tables for an FMU, and such an FMU as devices on a bus."""
