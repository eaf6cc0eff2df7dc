"""What the page is told and what it asks for; nothing here knows of a browser, or of an engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from emulator.engine.looks import Shape
from hil.bus.report import ListenerReport

Vector = tuple[float, float, float]


class Health(StrEnum):
    """How a node is, at a glance."""

    RUNNING = "running"
    IDLE = "idle"
    CHANGING = "changing"
    BROKEN = "broken"


@dataclass(frozen=True)
class WheelSketch:
    """A wheel as it is drawn.

    Attributes:
        corner: its steering axis in the chassis frame [m].
        axle: its centre in the frame of its knuckle [m].
        knuckle: what is drawn of the steering unit, in the frame of the knuckle.
        wheel: what is drawn of the wheel, in its own frame.
        radius: [m].
    """

    corner: Vector
    axle: Vector
    knuckle: tuple[Shape, ...]
    wheel: tuple[Shape, ...]
    radius: float


@dataclass(frozen=True)
class Offer:
    """A kind of fault that can be asked for.

    Attributes:
        kind: as it is called.
        places: where it can be.
        what: it does.
        numbers: that it takes, as (name, meaning).
    """

    kind: str
    places: tuple[str, ...]
    what: str
    numbers: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Sketch:
    """What does not change while the page is open.

    Attributes:
        title: of the page.
        drives, encoders: names of the nodes with their node-IDs, as (name, id).
        chassis: what is drawn of it, in its own frame.
        wheels: fl, rl, fr, rr.
        weight: of the vehicle [N].
        size: sum of wheelbase and track width [m].
        bit_rate: of the bus [bit/s].
        offers: faults to be asked for.
    """

    title: str
    drives: tuple[tuple[str, int], ...]
    encoders: tuple[tuple[str, int], ...]
    chassis: tuple[Shape, ...]
    wheels: tuple[WheelSketch, ...]
    weight: float
    size: float
    bit_rate: float
    offers: tuple[Offer, ...]


@dataclass(frozen=True)
class Pose:
    """Where the vehicle is.

    Attributes:
        position: of the chassis' centre in the world [m].
        orientation: its quaternion (x, y, z, w).
        angles: (8,) of the joints, steering then rolling, fl, rl, fr, rr [rad].
        normal_forces: of the floor on the wheels (4,) [N].
        drive_forces: with which the drives push the wheels forward (4,) [N]: torque times gear ratio over radius.
    """

    position: tuple[float, ...]
    orientation: tuple[float, ...]
    angles: tuple[float, ...]
    normal_forces: tuple[float, ...]
    drive_forces: tuple[float, ...]


@dataclass(frozen=True)
class DriveNow:
    """A drive now; SI units, vehicle signs.

    Attributes:
        health: at a glance.
        nmt: state of the node (CiA 301).
        state: of the power drive system (CiA 402).
        mode: of operation, 6061h.
        error_code: 603Fh.
        asked: torque demand 6074h at the motor shaft [Nm].
        torque: 6077h at the motor shaft [Nm].
        speed: of the wheel, 606Ch [rad/s].
        position_error: 60F4h at the wheel [rad]; NaN in modes that control torque, and without power.
        thermal_load: I2t [-].
    """

    health: Health
    nmt: str
    state: str
    mode: str
    error_code: int
    asked: float
    torque: float
    speed: float
    position_error: float
    thermal_load: float


@dataclass(frozen=True)
class EncoderNow:
    """A steering encoder now.

    Attributes:
        health: at a glance.
        nmt: state of the node (CiA 301).
        angle: that it reads [rad].
        error: reading less the true angle of its axis [rad].
    """

    health: Health
    nmt: str
    angle: float
    error: float


@dataclass(frozen=True)
class BusNow:
    """The bus now.

    Attributes:
        frames: so far.
        bits: so far, without and with all stuff bits; equal where they are counted.
        clients: processes on it, and the frames that they have lost.
    """

    frames: int
    bits: tuple[int, int]
    clients: tuple[ListenerReport, ...] = ()


@dataclass(frozen=True)
class CyclesNow:
    """How the loop keeps up with the clock.

    Attributes:
        served: SYNCs so far.
        overruns: times that it was more than a cycle late.
        worst: largest such lag [s].
    """

    served: int
    overruns: int
    worst: float


@dataclass(frozen=True)
class Doing:
    """The step that is driven, and how far it is, in what `unit` names; nothing where nobody says."""

    step: str = ""
    done: int = 0
    total: int = 0
    unit: str = "cycles"


@dataclass(frozen=True)
class ActiveFault:
    """A fault that lasts or is still to come: its number, its line of text, and whether it has begun."""

    number: int
    text: str
    begun: bool


@dataclass(frozen=True)
class Snapshot:
    """One instant.

    Attributes:
        time: simulated [s].
        wall: by the clock of the loop [s]; only differences mean something.
        pose: of the vehicle.
        drives, encoders: the nodes, in the order of the sketch.
        bus: frames, load, losses.
        cycles: None where the loop has no clock to keep up with.
        faults: that last or are to come.
        stopped: the emergency stop is pressed.
        doing: step of a campaign, or of a replay.
    """

    time: float
    wall: float
    pose: Pose
    drives: tuple[DriveNow, ...]
    encoders: tuple[EncoderNow, ...]
    bus: BusNow
    cycles: CyclesNow | None
    faults: tuple[ActiveFault, ...]
    stopped: bool
    doing: Doing


@dataclass(frozen=True)
class Told:
    """An answer to what was asked on the page."""

    text: str
    refused: bool = False


class Action(StrEnum):
    """What can be asked on the page."""

    INJECT = "inject"
    END = "end"
    END_ALL = "end all"
    STOP = "stop"
    RELEASE = "release"


@dataclass(frozen=True)
class Asked:
    """What was asked on the page, with its argument: a line of text that is a fault, or the number of one."""

    action: Action
    argument: str = ""


@dataclass(frozen=True)
class Ready:
    """The page is served at this port."""

    port: int


@dataclass(frozen=True)
class Failed:
    """The page cannot be served, and why."""

    what: str


Message = Sketch | Snapshot | Told | Asked | Ready | Failed
Messages = Sequence[Message]
