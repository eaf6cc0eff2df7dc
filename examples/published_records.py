"""Published records of real machines, read from local copies of their repositories into records of servo axes, SI.

No record is part of this project. Each is in a public repository; a copy lies in a folder named as the repository.
What has no uniform time is put on one by straight lines between samples, at the interval that it has for the most part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import io, signal

from ident.records.axis_record import AxisKind, AxisRecord, axis_record_from_channels
from ident.records.channels import Channels

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """What a file says, before it has a uniform time.

    Attributes:
        time: (N,) [s].
        position, effort: name of the axis to (N,) values [m, N or rad, Nm].
        kind: of all axes.
    """

    time: Array
    position: Mapping[str, Array]
    effort: Mapping[str, Array]
    kind: AxisKind = AxisKind.ROTARY


@dataclass(frozen=True)
class Machine:
    """A machine of which records are published.

    Attributes:
        repository: `owner/name` on GitHub.
        licence: as the repository states it.
        what: the machine, its drive and its rate.
        conversion: how the units become those of a record.
        read: one file into a motion.
    """

    repository: str
    licence: str
    what: str
    conversion: str
    read: Callable[[Path], Motion]

    @property
    def folder(self) -> str:
        """Name of the folder of a local copy."""
        return self.repository.partition("/")[2]

    @property
    def address(self) -> str:
        """Where the repository is."""
        return f"https://github.com/{self.repository}"


def uniform(motion: Motion) -> Motion:
    """The motion on a uniform time, by straight lines, at the median interval; one that has it already is unchanged."""
    steps = np.diff(motion.time)
    interval = float(np.median(steps))
    if np.allclose(steps, interval, rtol=1e-3, atol=0.0):
        return motion
    time = motion.time[0] + interval * np.arange(int((motion.time[-1] - motion.time[0]) / interval) + 1)
    position, effort = (
        {axis: np.interp(time, motion.time, values) for axis, values in channels.items()}
        for channels in (motion.position, motion.effort)
    )
    return Motion(time, position, effort, motion.kind)


def record(motion: Motion, axes: Sequence[str], source: str) -> AxisRecord:
    """A record of some axes of a motion; a single one has no name.

    Raises:
        KeyError: the motion has no such axis.
        RecordError: the motion breaks the contract of records.
    """
    even = uniform(motion)
    suffix = {axis: f"_{axis}" if len(axes) > 1 else "" for axis in axes}
    parts = (("position", even.position, even.kind.position_unit), ("effort", even.effort, even.kind.effort_unit))
    values: dict[str, NDArray[Any]] = {"time": even.time - even.time[0]}
    units = {"time": "s"}
    for part, channels, unit in parts:
        values |= {f"{part}{suffix[axis]}": channels[axis] for axis in axes}
        units |= {f"{part}{suffix[axis]}": unit for axis in axes}
    return axis_record_from_channels(Channels(values, units), source)


def _table(path: Path) -> Array:
    return np.loadtxt(path, delimiter=",", skiprows=1, dtype=float)


def _numbered(columns: Array) -> dict[str, Array]:
    """Columns (N, axes) by the number of their axis."""
    return {str(number): column for number, column in enumerate(columns.T, start=1)}


def read_kr300(path: Path) -> Motion:
    """Motor torques times the ratios of the gears, which the file has."""
    content = io.loadmat(path, squeeze_me=True, struct_as_record=False)
    recorded, ratios = content["rec"], np.asarray(content["para"].u, dtype=float)
    return Motion(
        np.asarray(recorded.time_cont, dtype=float),
        _numbered(np.radians(recorded.act_pos_mot_deg.T)),
        _numbered(recorded.act_torque_abs_nm.T * ratios),
    )


_TX40_RATIOS: Final = np.array([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
_TX40_RATE: Final = 5000.0
_TX40_DECIMATION: Final = 5


def read_tx40(path: Path) -> Motion:
    """Motor angles over the ratios, currents times them: torque constants are not stated, so an ampere is one Nm."""
    angles = _table(path) / _TX40_RATIOS
    currents = _table(path.with_name("curr_data.csv")) * _TX40_RATIOS
    fewer = [signal.decimate(raw, _TX40_DECIMATION, ftype="fir", axis=0) for raw in (angles, currents)]
    time = np.arange(len(fewer[0])) * _TX40_DECIMATION / _TX40_RATE
    return Motion(time, _numbered(fewer[0]), _numbered(fewer[1]))


_TIAGO_AXES: Final = ("torso", "arm_1", "arm_2", "arm_3", "arm_4")


def read_tiago(path: Path) -> Motion:
    """Efforts as the robot reports them. Those of the wrist have hardly any steps, so it is left out."""
    positions, efforts = _table(path), _table(path.with_name("tiago_effort.csv"))
    columns = slice(1, len(_TIAGO_AXES) + 1)
    angles, torques = (dict(zip(_TIAGO_AXES, raw[:, columns].T, strict=True)) for raw in (positions, efforts))
    return Motion(positions[:, 0], angles, torques)


def read_tiago_torso(path: Path) -> Motion:
    """The lift alone, which moves in metres."""
    motion = read_tiago(path)
    return Motion(motion.time, {"torso": motion.position["torso"]}, {"torso": motion.effort["torso"]}, AxisKind.LINEAR)


def read_double_pendulum(path: Path) -> Motion:
    """Shoulder and elbow, torque as their drives measure it: the last two columns, however many are before."""
    raw = _table(path)
    return Motion(raw[:, 0], _numbered(raw[:, 1:3]), _numbered(raw[:, -2:]))


def read_simple_pendulum(path: Path) -> Motion:
    """One joint, torque as its drive measures it."""
    time, angle, _, torque = _table(path).T
    return Motion(time, {"1": angle}, {"1": torque})


_FORCE_PER_CURRENT: Final = {
    "LinA": 42.9e-3 * 1000 * 2 * np.pi * 85.58 / 24,
    "LinD": 70.6e-3 * 1000 * 2 * np.pi * 50.95 / 48,
}
"""Torque constant times the whole ratio from motor to rod [N/A], from the `model_setup.m` of the actuator."""


def read_linear_actuator(path: Path) -> Motion:
    """Milliseconds, millimetres and milliamperes of a screw that a geared motor drives."""
    raw = np.loadtxt(path)
    force = _FORCE_PER_CURRENT[path.parent.parent.name] * raw[:, 5] * 1e-3
    return Motion(raw[:, 0] * 1e-3, {"1": raw[:, 3] * 1e-3}, {"1": force}, AxisKind.LINEAR)


def read_panda_joint(path: Path) -> Motion:
    """One joint: torque that the model of the robot leaves, which is friction for the most part."""
    raw = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 1, 4))
    return Motion(raw[:, 0], {"1": raw[:, 1]}, {"1": raw[:, 2]})


def read_hsm150(path: Path) -> Motion:
    """One shaft, torque that its drive is asked for."""
    raw = np.asarray(io.loadmat(path)["data"], dtype=float)
    return Motion(raw[:, 0], {"1": raw[:, 2]}, {"1": raw[:, 4]})


_MILL_AXES: Final = ("X", "Y")
_MILL_INTERVAL: Final = 0.1


def read_mill(path: Path) -> Motion:
    """Tables of a mill at 10 Hz, millimetres; force constants are not stated, so an ampere is one newton."""
    names = path.read_text(encoding="utf-8").partition("\n")[0].strip().split(",")
    wanted = [f"{axis}1_{what}" for what in ("ActualPosition", "CurrentFeedback") for axis in _MILL_AXES]
    raw = np.loadtxt(path, delimiter=",", skiprows=1, usecols=[names.index(name) for name in wanted])
    position, effort = (dict(zip(_MILL_AXES, part.T, strict=True)) for part in (raw[:, :2] * 1e-3, raw[:, 2:]))
    return Motion(np.arange(len(raw), dtype=np.float64) * _MILL_INTERVAL, position, effort, AxisKind.LINEAR)


_FIGAROH: Final = ("thanhndv212/figaroh-examples", "that of FIGAROH, as its README says")

MACHINES: Final[Mapping[str, Machine]] = {
    "kr300": Machine(
        "JonasWeigand/Robot_Identification",
        "MIT",
        "KUKA KR 300 R2500, six geared joints, 250 Hz, 10 s a record",
        "degrees to rad; motor torque times gear ratio",
        read_kr300,
    ),
    "tx40": Machine(
        *_FIGAROH,
        "Staubli TX40, six geared joints, 5 kHz, 9 s",
        "motor angle over gear ratio, motor current times gear ratio; every fifth sample behind a filter",
        read_tx40,
    ),
    "tiago": Machine(*_FIGAROH, "PAL TIAGo, geared joints of the arm, 100 Hz, 80 s", "none; uniform time", read_tiago),
    "tiago_torso": Machine(
        *_FIGAROH, "PAL TIAGo, lift of the torso, 100 Hz, 80 s", "none; uniform time", read_tiago_torso
    ),
    "double_pendulum": Machine(
        "dfki-ric-underactuated-lab/double_pendulum",
        "BSD-3-Clause",
        "double pendulum of DFKI, two motors with a planetary gear, 500 Hz, 10 s a record",
        "none; uniform time",
        read_double_pendulum,
    ),
    "simple_pendulum": Machine(
        "dfki-ric-underactuated-lab/torque_limited_simple_pendulum",
        "BSD-3-Clause",
        "pendulum of DFKI, a motor with a planetary gear, 330 to 1000 Hz, 4 to 30 s a record",
        "none; uniform time",
        read_simple_pendulum,
    ),
    "linear_actuator": Machine(
        "nicolazande/camber-control",
        "none stated",
        "actuators of a suspension, screw behind a planetary gear, 100 Hz, 30 s a record",
        "mm to m; motor current times torque constant times ratio",
        read_linear_actuator,
    ),
    "panda": Machine(
        "longshike/NNFM-A-Novel-Neural-Network-Modeling-Approach-for-Robot-Flexible-Joints-Friction",
        "none stated",
        "Franka Emika Panda, joint 2, strain-wave gear, about 420 Hz, 60 s a record",
        "none; uniform time of 500 Hz",
        read_panda_joint,
    ),
    "hsm150": Machine(
        "malik-robert/HSM150-data",
        "none stated",
        "servo motor HSM150 that turns a second one, direct drive, 1 kHz, 20 s a record",
        "none",
        read_hsm150,
    ),
    "mill": Machine(
        "ejhusom/cnc_milling_tool_wear",
        "none stated",
        "milling machine of the SMART lab of Michigan, screws, 10 Hz, 1 to 4 min a record",
        "mm to m; current as it is",
        read_mill,
    ),
}
