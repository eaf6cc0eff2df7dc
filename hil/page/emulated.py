"""What the page sees of an emulated vehicle and its nodes; it reads, and changes nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

from emulator.as_built import AsBuilt
from emulator.engine.layout import axle, corner
from emulator.engine.looks import chassis_shapes, knuckle_shapes, wheel_shapes
from emulator.engine.protocol import Engine
from emulator.firmware.drive import DriveApplication
from emulator.firmware.drive.modes import TORQUE_MODES
from emulator.firmware.drive.states import State
from emulator.firmware.network import DeviceNetwork
from emulator.firmware.nmt import NmtState
from emulator.firmware.node import Node as EmulatedNode
from hil.master.codec import Counter
from hil.network import Network, Node
from hil.network.cia import Index
from hil.page.offers import offers
from hil.page.shown import (
    ActiveFault,
    BusNow,
    CyclesNow,
    Doing,
    DriveNow,
    EncoderNow,
    Health,
    Pose,
    Sketch,
    Snapshot,
    WheelSketch,
)
from ident.vehicle.geometry import WHEELS
from ident.vehicle.quantities import GRAVITY

_TORQUE_DEMAND: Final = 0x6074
_FOLLOWING_ERROR: Final = 0x60F4
_VELOCITY: Final = 0x606C

_HEALTH: Final = {
    State.OPERATION_ENABLED: Health.RUNNING,
    State.FAULT: Health.BROKEN,
    State.FAULT_REACTION_ACTIVE: Health.BROKEN,
    State.QUICK_STOP_ACTIVE: Health.CHANGING,
}
"""States of a drive; in all others it has no power, and waits for its master."""


class Seen(Protocol):
    """An emulated vehicle, filmed or not."""

    @property
    def engine(self) -> Engine:
        """The physics."""

    @property
    def built(self) -> AsBuilt:
        """What it is."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""


def _no_doing() -> Doing:
    return Doing()


def _no_cycles() -> None:
    return None


@dataclass(frozen=True)
class Around:
    """What is to be seen beside the vehicle; each is asked at every look.

    Attributes:
        bus: frames, load, losses.
        doing: the step that is driven.
        cycles: how the loop keeps up with the clock.
    """

    bus: Callable[[], BusNow]
    doing: Callable[[], Doing] = field(default=_no_doing)
    cycles: Callable[[], CyclesNow | None] = field(default=_no_cycles)


class EmulatedView:
    """Looks at an emulated vehicle; implements `hil.page.watch.View`.

    Args:
        title: of the page.
        vehicle: the vehicle.
        devices: its nodes.
        network: their names and units, complete.
        around: what else there is to be seen.
    """

    def __init__(self, title: str, vehicle: Seen, devices: DeviceNetwork, network: Network, around: Around) -> None:
        self._title = title
        self._vehicle = vehicle
        self._devices = devices
        self._network = network
        self._around = around
        self._drives = network.drives
        self._encoders = tuple((node, Counter(node)) for node in network.encoders)
        geometry = vehicle.built.prototype.geometry
        self._force_per_torque = geometry.gear_ratio / geometry.wheel_radius

    def sketch(self) -> Sketch:
        """What does not change."""
        built = self._vehicle.built
        prototype = built.prototype
        geometry = prototype.geometry
        wheels = tuple(
            WheelSketch(
                corner(prototype, name),
                axle(prototype, name, build),
                tuple(knuckle_shapes(prototype, name, build)),
                tuple(wheel_shapes(prototype, build)),
                build.radius,
            )
            for name, build in zip(WHEELS, built.wheels, strict=True)
        )
        drives, encoders = _named(self._drives), _named([node for node, _ in self._encoders])
        return Sketch(
            self._title,
            drives,
            encoders,
            tuple(chassis_shapes(prototype)),
            wheels,
            prototype.truth["m_ch"] * GRAVITY,
            geometry.wheelbase + geometry.track_width,
            self._network.bit_rate,
            offers([name for name, _ in drives], [name for name, _ in encoders]),
        )

    def look(self, wall: float, faults: tuple[ActiveFault, ...], stopped: bool) -> Snapshot:
        """What there is to be seen now."""
        drives = tuple(self._drive(node) for node in self._drives)
        encoders = tuple(self._encoder(side, node, counter) for side, (node, counter) in enumerate(self._encoders))
        around = self._around
        return Snapshot(
            self._vehicle.time,
            wall,
            self._pose(drives),
            drives,
            encoders,
            around.bus(),
            around.cycles(),
            faults,
            stopped,
            around.doing(),
        )

    def _pose(self, drives: Sequence[DriveNow]) -> Pose:
        engine = self._vehicle.engine
        position, orientation = engine.base_pose()
        return Pose(
            tuple(position),
            tuple(orientation),
            tuple(engine.angles()),
            tuple(normal for normal, _ in engine.floor_forces()),
            tuple(drive.torque * self._force_per_torque for drive in drives),
        )

    def _drive(self, node: Node) -> DriveNow:
        emulated = self._devices.nodes[node.node_id]
        drive = emulated.application
        assert isinstance(drive, DriveApplication)
        value = emulated.object_dictionary.value
        follows = drive.moving and drive.mode not in TORQUE_MODES
        return DriveNow(
            _health(emulated, _HEALTH.get(drive.state, Health.IDLE)),
            _nmt(emulated),
            drive.state.name.replace("_", " ").lower(),
            drive.mode.name.replace("_", " ").lower(),
            drive.error_code,
            value(_TORQUE_DEMAND) * node.torque_unit,
            value(Index.TORQUE_ACTUAL) * node.torque_unit,
            value(_VELOCITY) * node.angle_unit,
            value(_FOLLOWING_ERROR) * node.angle_unit if follows else math.nan,
            drive.axis.hardware.thermal_load,
        )

    def _encoder(self, side: int, node: Node, counter: Counter) -> EncoderNow:
        emulated = self._devices.nodes[node.node_id]
        angle = counter.angle(emulated.object_dictionary.value(Index.ENCODER_POSITION))
        operational = emulated.nmt.state is NmtState.OPERATIONAL
        return EncoderNow(
            _health(emulated, Health.RUNNING if operational else Health.IDLE),
            _nmt(emulated),
            angle,
            angle - self._vehicle.engine.steering_angle(side),
        )


def _named(nodes: Sequence[Node]) -> tuple[tuple[str, int], ...]:
    return tuple((str(node.role), node.node_id) for node in nodes)


def _nmt(node: EmulatedNode) -> str:
    if node.network.connected:
        return node.nmt.state.name.replace("_", "-").lower()
    return "no supply" if node.nmt.state is NmtState.INITIALISATION else "bus-off"


def _health(node: EmulatedNode, of_profile: Health) -> Health:
    return of_profile if node.network.connected else Health.BROKEN
