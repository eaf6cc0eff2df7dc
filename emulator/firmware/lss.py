"""LSS slave (CiA 305): node-ID and bit rate of a device over the bus, by its identity and not by its node-ID."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Final

from emulator.firmware.nodebus import NodeBus

FROM_MASTER: Final = 0x7E5
FROM_SLAVE: Final = 0x7E4
UNCONFIGURED: Final = 0xFF
"""The node-ID of a device that has none."""

_FRAME_SIZE: Final = 8
_HIGHEST: Final = 127
_FOUND_ANY: Final = 0x80
"""Bit number of a fastscan that asks whether there is anybody at all."""

_BIT_RATE_TABLE: Final = 0
BIT_RATES: Final = (0, 2, 3, 4)
"""Indices of the CiA bit timing table that the EDS files name: 1000, 500, 250, 125 kbit/s."""


class Service(IntEnum):
    """Command specifiers."""

    SWITCH_GLOBAL = 0x04
    CONFIGURE_NODE_ID = 0x11
    CONFIGURE_BIT_TIMING = 0x13
    ACTIVATE_BIT_TIMING = 0x15
    STORE = 0x17
    SELECT_VENDOR = 0x40
    SELECT_PRODUCT = 0x41
    SELECT_REVISION = 0x42
    SELECT_SERIAL = 0x43
    SELECTED = 0x44
    IDENTIFY_VENDOR = 0x46
    IDENTIFY_PRODUCT = 0x47
    IDENTIFY_LOWEST_REVISION = 0x48
    IDENTIFY_HIGHEST_REVISION = 0x49
    IDENTIFY_LOWEST_SERIAL = 0x4A
    IDENTIFY_HIGHEST_SERIAL = 0x4B
    IDENTIFY_UNCONFIGURED = 0x4C
    IDENTIFIED = 0x4F
    UNCONFIGURED_IDENTIFIED = 0x50
    FASTSCAN = 0x51
    INQUIRE_VENDOR = 0x5A
    INQUIRE_PRODUCT = 0x5B
    INQUIRE_REVISION = 0x5C
    INQUIRE_SERIAL = 0x5D
    INQUIRE_NODE_ID = 0x5E


class LssState(Enum):
    """Which services a device takes."""

    WAITING = 0
    CONFIGURATION = 1


class Refusal(IntEnum):
    """Error codes of the configuration services."""

    NONE = 0
    OUT_OF_RANGE = 1
    STORE_FAILED = 2


@dataclass(frozen=True)
class LssSettings:
    """What LSS configures.

    Attributes:
        node_id: 1 to 127, or `UNCONFIGURED`.
        bit_rate: index of the CiA bit timing table.
    """

    node_id: int
    bit_rate: int = 0


@dataclass(frozen=True)
class LssEvents:
    """What an LSS slave tells its device.

    Attributes:
        store: keep settings beyond a loss of supply; raises OSError where that fails.
        left_configuration: back in the waiting state.
    """

    store: Callable[[LssSettings], None]
    left_configuration: Callable[[], None]


class _Sequence:
    """Steps that have to come in their order, each of them met.

    Args:
        steps: service -> whether its number is met.
    """

    def __init__(self, steps: Mapping[Service, Callable[[int], bool]]) -> None:
        self._steps = steps
        self._order = tuple(steps)
        self._next = 0

    def takes(self, service: Service, number: int) -> bool:
        """Take one step; True with the last one, if all were met."""
        position = self._order.index(service)
        fits = position in (0, self._next) and self._steps[service](number)
        self._next = position + 1 if fits else 0
        if self._next < len(self._order):
            return False
        self._next = 0
        return True


class LssSlave:
    """LSS of one device.

    Args:
        identity: vendor, product, revision, serial number (1018h).
        settings: those that are in force.
        bus: its CAN controller.
        events: what it tells its device.

    Attributes:
        active: the node-ID in force.
        pending: what is in force after the next reset.
    """

    def __init__(
        self, identity: tuple[int, int, int, int], settings: LssSettings, bus: NodeBus, events: LssEvents
    ) -> None:
        self._identity = identity
        self._bus = bus
        self._events = events
        self._state = LssState.WAITING
        self._scanned = 0
        vendor, product, revision, serial = identity
        self._selection = _Sequence(
            {
                Service.SELECT_VENDOR: vendor.__eq__,
                Service.SELECT_PRODUCT: product.__eq__,
                Service.SELECT_REVISION: revision.__eq__,
                Service.SELECT_SERIAL: serial.__eq__,
            }
        )
        self._identification = _Sequence(
            {
                Service.IDENTIFY_VENDOR: vendor.__eq__,
                Service.IDENTIFY_PRODUCT: product.__eq__,
                Service.IDENTIFY_LOWEST_REVISION: revision.__ge__,
                Service.IDENTIFY_HIGHEST_REVISION: revision.__le__,
                Service.IDENTIFY_LOWEST_SERIAL: serial.__ge__,
                Service.IDENTIFY_HIGHEST_SERIAL: serial.__le__,
            }
        )
        self._services: Mapping[int, Callable[[bytes], None]] = {
            Service.SWITCH_GLOBAL: self._switch,
            Service.CONFIGURE_NODE_ID: self._configure_node_id,
            Service.CONFIGURE_BIT_TIMING: self._configure_bit_timing,
            Service.STORE: self._store,
            Service.IDENTIFY_UNCONFIGURED: self._identify_unconfigured,
            Service.FASTSCAN: self._scan,
            Service.INQUIRE_NODE_ID: self._tell_node_id,
            **dict.fromkeys(range(Service.SELECT_VENDOR, Service.SELECT_SERIAL + 1), self._select),
            **dict.fromkeys(range(Service.IDENTIFY_VENDOR, Service.IDENTIFY_HIGHEST_SERIAL + 1), self._identify),
            **dict.fromkeys(range(Service.INQUIRE_VENDOR, Service.INQUIRE_SERIAL + 1), self._tell_identity),
        }
        self.restart(settings)
        bus.subscribe(FROM_MASTER, self._receive)

    def restart(self, settings: LssSettings) -> None:
        """Power-on with these settings."""
        self._state = LssState.WAITING
        self._scanned = 0
        self.active = settings.node_id
        self.pending = settings

    def _receive(self, _can_id: int, data: bytes) -> None:
        service = self._services.get(data[0]) if len(data) == _FRAME_SIZE else None
        if service is not None:
            service(data)

    def _answer(self, service: int, *data: int) -> None:
        self._bus.send(FROM_SLAVE, bytes((service, *data)).ljust(_FRAME_SIZE, b"\x00"))

    def _switch(self, data: bytes) -> None:
        if data[1] == LssState.CONFIGURATION.value:
            self._state = LssState.CONFIGURATION
        elif data[1] == LssState.WAITING.value and self._state is LssState.CONFIGURATION:
            self._state = LssState.WAITING
            self._events.left_configuration()

    def _select(self, data: bytes) -> None:
        if self._state is LssState.WAITING and self._selection.takes(Service(data[0]), _number(data)):
            self._state = LssState.CONFIGURATION
            self._answer(Service.SELECTED)

    def _identify(self, data: bytes) -> None:
        if self._identification.takes(Service(data[0]), _number(data)):
            self._answer(Service.IDENTIFIED)

    def _identify_unconfigured(self, _data: bytes) -> None:
        if self.active == UNCONFIGURED:
            self._answer(Service.UNCONFIGURED_IDENTIFIED)

    def _scan(self, data: bytes) -> None:
        """Fastscan: whether the upper bits of one part of the identity are those; of devices without a node-ID."""
        if self.active != UNCONFIGURED or self._state is LssState.CONFIGURATION:
            return
        number, bit, part, following = _number(data), data[5], data[6], data[7]
        if bit == _FOUND_ANY:
            self._scanned = 0
            self._answer(Service.IDENTIFIED)
            return
        if part != self._scanned or bit > 31 or following > 3 or (number ^ self._identity[part]) >> bit:
            return
        self._answer(Service.IDENTIFIED)
        if bit == 0:
            self._scanned = following
            if following < part:
                self._state = LssState.CONFIGURATION

    def _configure_node_id(self, data: bytes) -> None:
        if self._state is not LssState.CONFIGURATION:
            return
        fits = 1 <= data[1] <= _HIGHEST or data[1] == UNCONFIGURED
        if fits:
            self.pending = LssSettings(data[1], self.pending.bit_rate)
        self._answer(data[0], Refusal.NONE if fits else Refusal.OUT_OF_RANGE)

    def _configure_bit_timing(self, data: bytes) -> None:
        if self._state is not LssState.CONFIGURATION:
            return
        fits = data[1] == _BIT_RATE_TABLE and data[2] in BIT_RATES
        if fits:
            self.pending = LssSettings(self.pending.node_id, data[2])
        self._answer(data[0], Refusal.NONE if fits else Refusal.OUT_OF_RANGE)

    def _store(self, data: bytes) -> None:
        if self._state is not LssState.CONFIGURATION:
            return
        try:
            self._events.store(self.pending)
        except OSError:
            self._answer(data[0], Refusal.STORE_FAILED)
        else:
            self._answer(data[0], Refusal.NONE)

    def _tell_identity(self, data: bytes) -> None:
        if self._state is LssState.CONFIGURATION:
            self._answer(data[0], *struct.pack("<I", self._identity[data[0] - Service.INQUIRE_VENDOR]))

    def _tell_node_id(self, data: bytes) -> None:
        if self._state is LssState.CONFIGURATION:
            self._answer(data[0], self.active)


def _number(data: bytes) -> int:
    return int.from_bytes(data[1:5], "little")
