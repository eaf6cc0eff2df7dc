"""CANopen devices on a bus as an FMU of FMI-LS-BUS 1.0: their tables, their description, and the package."""
