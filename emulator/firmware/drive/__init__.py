"""Drive profile CiA 402: state machine, modes of operation, stops by option code, faults."""

from emulator.firmware.drive.application import DriveApplication

__all__ = ["DriveApplication"]
