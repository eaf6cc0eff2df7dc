"""Faults of nodes, sensors and ground: what begins each, and what ends it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final, Protocol

from emulator.firmware.drive import DriveApplication
from emulator.firmware.drive.faults import OF_TRIP
from emulator.firmware.drive.faults import Fault as DriveFault
from emulator.firmware.emergency import ErrorRegister
from emulator.firmware.network import DeviceNetwork
from hil.bus.frame_kinds import ERROR_FRAME, PROTOCOL_ERROR
from hil.faults.agenda import Agenda
from hil.faults.fault import Fault, FaultError, FaultKind
from hil.faults.hardware import EncoderTap, TappedVehicle
from hil.faults.places import Places, identifier

End = Callable[[], None]
"""Ends a fault."""

Begin = Callable[[], End]
"""Begins a fault."""

_RETRIES: Final = 32
"""Failed transmissions, 8 error counts each, until a controller is bus-off at 256 (ISO 11898-1)."""


class Slippery(Protocol):
    """Ground under wheels that can be made slippery."""

    def wet(self, wheel: int, coefficient: float) -> None:
        """Give the ground under a wheel another coefficient of friction."""

    def dry(self, wheel: int) -> None:
        """Take that back."""


@dataclass(frozen=True)
class Reach:
    """What a fault can get at.

    Attributes:
        devices: the nodes.
        vehicle: their hardware.
        places: names.
        ground: under the wheels, None where there is none.
        agenda: instants of simulated time.
        send: puts a frame on the bus.
    """

    devices: DeviceNetwork
    vehicle: TappedVehicle
    places: Places
    ground: Slippery | None
    agenda: Agenda
    send: Callable[[int, bytes], None]

    def tap(self, name: str) -> EncoderTap:
        """The encoder of a drive, or on a steering axis."""
        kind, number = self.places.hardware(name)
        return self.vehicle.taps[kind][number]


def _power(fault: Fault, reach: Reach) -> Begin:
    node_id = reach.places.node(fault.place)

    def begin() -> End:
        reach.devices.power_off(node_id)
        return partial(reach.devices.power_on, node_id)

    return begin


def _bus_off(fault: Fault, reach: Reach) -> Begin:
    node_id = reach.places.node(fault.place)

    def begin() -> End:
        for _ in range(_RETRIES):
            reach.send(ERROR_FRAME | PROTOCOL_ERROR, bytes(8))
        reach.devices.bus_off(node_id)
        return partial(reach.devices.bus_on, node_id)

    return begin


def _babble(fault: Fault, reach: Reach) -> Begin:
    can_id, period, data = identifier(fault.place), 1.0 / fault.number("rate"), bytes(int(fault.number("length")))

    def begin() -> End:
        lasting = [True]

        def babble() -> None:
            if lasting:
                reach.send(can_id, data)
                reach.devices.receive(can_id, data)
                reach.agenda.at(reach.devices.time + period, babble)

        babble()
        return lasting.clear

    return begin


def _trip(fault: Fault, reach: Reach) -> Begin:
    drive = reach.devices.nodes[reach.places.drive(fault.place)].application
    code = int(fault.number("code"))
    known = {one.code: one for one in OF_TRIP.values()}
    cause = known.get(code, DriveFault(code, ErrorRegister.GENERIC))

    def begin() -> End:
        if isinstance(drive, DriveApplication):
            drive.trip(cause)
        return _nothing

    return begin


def _stuck(fault: Fault, reach: Reach) -> Begin:
    tap = reach.tap(fault.place)

    def begin() -> End:
        tap.stick()
        return tap.release

    return begin


def _jump(fault: Fault, reach: Reach) -> Begin:
    tap, counts = reach.tap(fault.place), int(fault.number("counts"))

    def begin() -> End:
        tap.jump(counts)
        return partial(tap.jump, -counts)

    return begin


def _friction(fault: Fault, reach: Reach) -> Begin:
    ground, wheels = reach.ground, reach.places.wheels(fault.place)
    if ground is None:
        raise FaultError("These wheels stand on no ground.", "Use the emulated vehicle.")

    def begin() -> End:
        for wheel in wheels:
            ground.wet(wheel, fault.number("value"))
        return end

    def end() -> None:
        for wheel in wheels:
            ground.dry(wheel)

    return begin


def _estop(fault: Fault, reach: Reach) -> Begin:
    nodes = reach.places.vehicle(fault.place)

    def drives() -> list[DriveApplication]:
        applications = (reach.devices.nodes[node].application for node in nodes)
        return [one for one in applications if isinstance(one, DriveApplication)]

    def begin() -> End:
        for drive in drives():
            drive.press_stop()
        return end

    def end() -> None:
        for drive in drives():
            drive.release_stop()

    return begin


def _nothing() -> None:
    """A fault that leaves nothing behind to be ended."""


PREPARATIONS: Final[Mapping[FaultKind, Callable[[Fault, Reach], Begin]]] = {
    FaultKind.BABBLE: _babble,
    FaultKind.BUS_OFF: _bus_off,
    FaultKind.POWER: _power,
    FaultKind.TRIP: _trip,
    FaultKind.STUCK: _stuck,
    FaultKind.JUMP: _jump,
    FaultKind.FRICTION: _friction,
    FaultKind.ESTOP: _estop,
}
"""The kinds that act on devices; names are looked up when a fault is injected, not when it begins."""
