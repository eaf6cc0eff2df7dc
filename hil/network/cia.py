"""Names for the numbers of CiA 301 (CANopen), CiA 402 (drives) and CiA 406 (encoders) that this side of the bus uses.

The firmware of the emulated nodes has its own: master and nodes share no reading of the standards.
"""

from __future__ import annotations

from enum import Enum, IntEnum, IntFlag
from typing import Final

HIGHEST_CAN_ID: Final = 0x7FF
"""Of 11 bits."""

FUNCTION_CODE: Final = 0x780
"""Bits of a CAN identifier that say which service (CiA 301, predefined connection set)."""

NODE_ID: Final = 0x7F
"""Bits of a CAN identifier that say whose it is."""

NMT_STATE: Final = 0x7F
"""Bits of a heartbeat that are the NMT state; the other is the toggle bit of node guarding."""


class Service(IntEnum):
    """First CAN identifiers of the services (CiA 301, predefined connection set); the node id is added to most."""

    NMT = 0x000
    SYNC = 0x080
    EMERGENCY = 0x080
    TPDO_1 = 0x180
    RPDO_1 = 0x200
    SDO_ANSWER = 0x580
    SDO_REQUEST = 0x600
    HEARTBEAT = 0x700


PDO_SPACING: Final = 0x100
"""Between the identifiers of two PDOs of a node."""


class CobId(IntFlag):
    """Bits of a COB-ID entry of a PDO (CiA 301, 1400h and 1800h)."""

    INVALID = 1 << 31
    NO_REMOTE = 1 << 30
    EXTENDED = 1 << 29


class NmtCommand(IntEnum):
    """Command specifiers (CiA 301, NMT node control)."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """States as heartbeats report them (CiA 301, NMT error control)."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F

    @property
    def label(self) -> str:
        """The state in words, `pre-operational`."""
        return self.name.lower().replace("_", "-")


SDO_ABORT: Final = 0x80
"""Command of an SDO that ends a transfer (CiA 301, abort SDO transfer)."""


class Index(IntEnum):
    """Objects by their names in CiA 301, 402-2 and 406."""

    DEVICE_TYPE = 0x1000
    SYNC_COB_ID = 0x1005
    CONSUMER_HEARTBEAT_TIME = 0x1016
    PRODUCER_HEARTBEAT_TIME = 0x1017
    IDENTITY = 0x1018
    RPDO_COMMUNICATION = 0x1400
    TPDO_COMMUNICATION = 0x1800
    MEASURING_UNITS_PER_REVOLUTION = 0x6001
    TOTAL_MEASURING_RANGE = 0x6002
    ENCODER_POSITION = 0x6004
    ABORT_CONNECTION_OPTION = 0x6007
    ERROR_CODE = 0x603F
    CONTROLWORD = 0x6040
    STATUSWORD = 0x6041
    QUICK_STOP_OPTION = 0x605A
    FAULT_REACTION_OPTION = 0x605E
    MODES_OF_OPERATION = 0x6060
    MODES_OF_OPERATION_DISPLAY = 0x6061
    POSITION_ACTUAL = 0x6064
    VELOCITY_ACTUAL = 0x606C
    TARGET_TORQUE = 0x6071
    MAX_TORQUE = 0x6072
    TORQUE_DEMAND = 0x6074
    MOTOR_RATED_TORQUE = 0x6076
    TORQUE_ACTUAL = 0x6077
    MAX_MOTOR_SPEED = 0x6080
    QUICK_STOP_DECELERATION = 0x6085
    ENCODER_RESOLUTION = 0x608F
    TORQUE_OFFSET = 0x60B2
    TARGET_VELOCITY = 0x60FF
    SUPPORTED_DRIVE_MODES = 0x6502


PDO_MAPPING: Final = 0x200
"""From the index of a PDO's communication record to that of its mapping (1400h, 1600h)."""


class DataType(IntEnum):
    """Codes of the integers that a PDO may carry (CiA 301, data types)."""

    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    INTEGER64 = 0x15
    UNSIGNED64 = 0x1B


class ErrorCode(IntEnum):
    """Emergency error codes (CiA 301 and 402-2)."""

    CONTINUOUS_OVER_CURRENT = 0x2310
    HEARTBEAT = 0x8130


class Mode(IntEnum):
    """Modes of operation (CiA 402-2, 6060h)."""

    CYCLIC_SYNCHRONOUS_TORQUE = 10

    @property
    def supported_bit(self) -> int:
        """Its bit in 6502h."""
        return 1 << (self - 1)


class Controlword(IntEnum):
    """Commands (CiA 402-2, 6040h)."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


class DriveState(Enum):
    """States of the power drive system; the value is (mask, pattern) of the statusword (CiA 402-2, table 30)."""

    NOT_READY_TO_SWITCH_ON = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    @property
    def label(self) -> str:
        """The name of the standard."""
        return self.name.lower().replace("_", " ")
