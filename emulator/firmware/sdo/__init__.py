"""SDO server of CiA 301, 7.2.4: expedited, segmented and block transfer, both ways."""

from emulator.firmware.sdo.server import SdoServer

__all__ = ["SdoServer"]
