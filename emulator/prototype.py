"""The prototype file: everything about the vehicle behind the connector, hidden truth included."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from emulator.power_stage import PowerStageData
from emulator.rigid_bodies import RigidBodies, derive_rigid_bodies
from ident.errors import DataFileError
from ident.vehicle.description import find_data_file
from ident.vehicle.geometry import WHEELS, Geometry, read_geometry
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters, read_parameters
from ident.vehicle.quantities import read_quantities, read_toml, refuse_unknown, require_table

SIDES: Final = ("left", "right")
"""Order of the steering encoders."""

TABLE_UNITS: Final[Mapping[str, Mapping[str, str]]] = {
    "units": {"wheel_mass": "kg", "knuckle_mass": "kg"},
    "body": {"length": "m", "width": "m", "height": "m", "centre_height": "m"},
    "floor": {"friction": "1"},
    "tyre": {"stiffness": "N/m", "damping_ratio": "1"},
    "drive": {
        "rated_torque": "Nm",
        "peak_torque": "Nm",
        "rated_current": "A",
        "peak_current": "A",
        "current_loop_bandwidth": "rad/s",
        "interpolation_time": "s",
        "counts_per_revolution": "1",
        **{f"direction_{wheel}": "1" for wheel in WHEELS},
    },
    "power_stage": {
        "supply_voltage": "V",
        "link_capacitance": "F",
        "chopper_voltage": "V",
        "chopper_power": "W",
        "over_voltage": "V",
        "phase_resistance": "Ohm",
        "peak_time": "s",
        "overload_time": "s",
        "stall_time": "s",
    },
    "steering_encoder": {
        "counts_per_revolution": "1",
        "zero_position": "1",
        **{f"direction_{side}": "1" for side in SIDES},
    },
    "noise": {
        "torque_sensor": "1",
        "encoder_dither": "1",
        "load_fluctuation": "1",
        "load_correlation_time": "s",
    },
}
"""Tables of a prototype file beside [geometry] and [truth], with the unit of each entry."""


@dataclass(frozen=True)
class DriveData:
    """Data sheet of one wheel drive: power stage, current loop, motor and motor encoder.

    Attributes:
        rated_torque, peak_torque: at the motor shaft [Nm].
        rated_current, peak_current: rms [A].
        current_loop_bandwidth: corner frequency of the first-order current loop [rad/s].
        interpolation_time: time over which the drive moves linearly to a new set-point [s].
        counts_per_revolution: motor increments per turn of the shaft.
        directions: +1 or -1 per wheel (fl, rl, fr, rr): sign of shaft rotation when the wheel rolls forward.
    """

    rated_torque: float
    peak_torque: float
    rated_current: float
    peak_current: float
    current_loop_bandwidth: float
    interpolation_time: float
    counts_per_revolution: int
    directions: tuple[int, ...]


@dataclass(frozen=True)
class EncoderData:
    """Data sheet and mounting of the steering encoders.

    Attributes:
        counts_per_revolution: increments per turn.
        zero_positions: reading with the wheels straight per side (left, right), increments.
        directions: +1 or -1 per side (left, right): sign of counts when the front wheel turns left.
    """

    counts_per_revolution: int
    zero_positions: tuple[int, ...]
    directions: tuple[int, ...]


@dataclass(frozen=True)
class NoiseData:
    """Sizes of the random disturbances.

    Attributes:
        torque_sensor: rms of the torque reading, as a fraction of rated torque [-].
        encoder_dither: rms ahead of the rounding to increments [increments].
        load_fluctuation: rms of the fluctuating load, as a fraction of the joint's Coulomb torque [-].
        load_correlation_time: of that load [s].
    """

    torque_sensor: float
    encoder_dither: float
    load_fluctuation: float
    load_correlation_time: float


@dataclass(frozen=True)
class Body:
    """Outer shape of the chassis and height of its centre of mass above the floor [m]."""

    length: float
    width: float
    height: float
    centre_height: float


@dataclass(frozen=True)
class Tyre:
    """Radial compliance of a wheel.

    Attributes:
        stiffness: [N/m].
        damping_ratio: of the vehicle's heave on its four tyres [-].
    """

    stiffness: float
    damping_ratio: float


@dataclass(frozen=True)
class Prototype:
    """The vehicle behind the connector.

    Attributes:
        name: of the prototype.
        path: file that describes it.
        geometry: lengths, gear ratio, steering stops.
        truth: the eleven parameters an identification should find.
        body: outer shape of the chassis.
        rigid_bodies: masses and inertias of chassis, knuckles, wheels; their totals are `truth`.
        floor_friction: adhesion between wheel and floor [-].
        tyre: radial compliance of the wheels.
        drive, power_stage, encoder, noise: data sheets.
        solver_sweeps: of an engine that relaxes its contacts step by step: so many are enough for this vehicle. Wheels
            that are light beside what steers them need more.
    """

    name: str
    path: Path
    geometry: Geometry
    truth: Parameters
    body: Body
    rigid_bodies: RigidBodies
    floor_friction: float
    tyre: Tyre
    drive: DriveData
    power_stage: PowerStageData
    encoder: EncoderData
    noise: NoiseData
    solver_sweeps: int = 100


def load_prototype(name_or_path: str | Path = "prototype") -> Prototype:
    """Read a prototype, shipped (by name: `prototype`, `compact`) or the user's own (by path).

    Raises:
        DataFileError: the file is missing, malformed, or describes a vehicle that cannot be.
    """
    path = find_data_file("emulator", name_or_path)
    document = read_toml(path)
    geometry = read_geometry(require_table(document, "geometry", path), path)
    truth = read_parameters(path, "truth")
    tables = {name: _read_table(document, name, path) for name in TABLE_UNITS}
    refuse_unknown(document, ("name", "description", "geometry", "truth", *TABLE_UNITS), f"{path}:")
    return build_prototype(str(document.get("name", path.stem)), geometry, truth, tables, path)


def build_prototype(
    name: str, geometry: Geometry, truth: Parameters, tables: Mapping[str, Mapping[str, float]], path: Path
) -> Prototype:
    """A prototype from the numbers of TABLE_UNITS, table by table.

    Args:
        name: of the prototype.
        geometry, truth: lengths, and the parameters an identification should find.
        tables: the values, in the units of TABLE_UNITS.
        path: file named in errors.

    Raises:
        DataFileError: the numbers describe a vehicle that cannot be.
    """
    _require_positive({name: truth[name] for name in PARAMETER_NAMES}, "truth", path)
    body = Body(**tables["body"])
    return Prototype(
        name=name,
        path=path,
        geometry=geometry,
        truth=truth,
        body=body,
        rigid_bodies=derive_rigid_bodies(
            geometry, truth, (body.length, body.width, body.height), path, **tables["units"]
        ),
        floor_friction=tables["floor"]["friction"],
        tyre=Tyre(**tables["tyre"]),
        drive=_drive(dict(tables["drive"]), path),
        power_stage=_power_stage(dict(tables["power_stage"]), path),
        encoder=_encoder(dict(tables["steering_encoder"]), path),
        noise=NoiseData(**tables["noise"]),
    )


def _read_table(document: Mapping[str, Any], name: str, path: Path) -> dict[str, float]:
    quantities = read_quantities(require_table(document, name, path), TABLE_UNITS[name], f"{path}: {name}")
    values = {key: quantity.value for key, quantity in quantities.items()}
    positive = {key: value for key, value in values.items() if not key.startswith("direction_")}
    if name == "noise":
        _require_positive({"load_correlation_time": values["load_correlation_time"]}, name, path)
        _require_not_negative(positive, name, path)
    else:
        _require_positive(positive, name, path)
    return values


def _require_positive(values: Mapping[str, float], table: str, path: Path) -> None:
    for key, value in values.items():
        if value <= 0:
            raise DataFileError(f"{path}: {table}.{key} = {value} cannot be.", "It must be positive.")


def _require_not_negative(values: Mapping[str, float], table: str, path: Path) -> None:
    for key, value in values.items():
        if value < 0:
            raise DataFileError(f"{path}: {table}.{key} = {value} cannot be.", "It must not be negative.")


def _directions(table: dict[str, float], names: tuple[str, ...], where: str) -> tuple[int, ...]:
    directions = tuple(table.pop(f"direction_{name}") for name in names)
    for name, direction in zip(names, directions, strict=True):
        if direction not in (1.0, -1.0):
            raise DataFileError(
                f"{where}.direction_{name} = {direction} cannot be.", "A mounting direction is 1 or -1."
            )
    return tuple(int(direction) for direction in directions)


def _whole(table: dict[str, float], key: str, where: str) -> int:
    value = table.pop(key)
    if not value.is_integer():
        raise DataFileError(f"{where}.{key} = {value} cannot be.", "It counts increments: give a whole number.")
    return int(value)


def _drive(table: dict[str, float], path: Path) -> DriveData:
    where = f"{path}: drive"
    if table["peak_torque"] < table["rated_torque"] or table["peak_current"] < table["rated_current"]:
        raise DataFileError(f"{where}: peak torque or current is below the rated one.", "Check the data sheet.")
    directions = _directions(table, WHEELS, where)
    return DriveData(
        counts_per_revolution=_whole(table, "counts_per_revolution", where), directions=directions, **table
    )


def _power_stage(table: dict[str, float], path: Path) -> PowerStageData:
    if not table["supply_voltage"] < table["chopper_voltage"] < table["over_voltage"]:
        raise DataFileError(
            f"{path}: power_stage: supply, chopper and over-voltage are not in ascending order.",
            "Check the data sheet: the chopper works above the supply and below the trip level.",
        )
    return PowerStageData(**table)


def _encoder(table: dict[str, float], path: Path) -> EncoderData:
    where = f"{path}: steering_encoder"
    return EncoderData(
        counts_per_revolution=_whole(table, "counts_per_revolution", where),
        zero_positions=(_whole(table, "zero_position", where),) * len(SIDES),
        directions=_directions(table, SIDES, where),
    )
