"""What is known of a vehicle before its campaign: geometry, prior guesses, limits of drives and floor."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Final

from ident.errors import DataFileError
from ident.vehicle.geometry import Geometry, read_geometry
from ident.vehicle.parameters import PARAMETER_UNITS, Parameters, read_parameters
from ident.vehicle.quantities import read_quantities, read_toml, refuse_unknown, require_table

KEYS: Final = ("name", "description", "geometry", "prior", "limits")
"""What a vehicle file may hold at its top."""

LIMIT_UNITS: Final = {
    "rated_torque": "Nm",
    "peak_torque": "Nm",
    "motor_speed": "rad/s",
    "floor_friction": "1",
    "floor_length": "m",
    "floor_width": "m",
}


@dataclass(frozen=True)
class Limits:
    """What drives and floor allow.

    Attributes:
        rated_torque, peak_torque: of a motor, at its shaft [Nm].
        motor_speed: of a motor [rad/s].
        floor_friction: adhesion between wheel and floor [-].
        floor_length, floor_width: free floor along and across the vehicle at its start [m].
    """

    rated_torque: float
    peak_torque: float
    motor_speed: float
    floor_friction: float
    floor_length: float
    floor_width: float


@dataclass(frozen=True)
class VehicleDescription:
    """A vehicle file: the vehicle's name, geometry, prior parameters and limits; `path` is the file, for messages."""

    name: str
    geometry: Geometry
    prior: Parameters
    limits: Limits
    path: Path | None = field(default=None, compare=False)


def find_data_file(package: str, name_or_path: str | Path) -> Path:
    """The file `<name>.toml` shipped in a package's data folder, or the path itself when it has a suffix.

    Raises:
        DataFileError: no file of that name is shipped.
    """
    if Path(name_or_path).suffix or "/" in str(name_or_path):
        return Path(name_or_path)
    folder = Path(str(resources.files(package))) / "data"
    path = folder / f"{name_or_path}.toml"
    if not path.is_file():
        names = ", ".join(sorted(entry.stem for entry in folder.glob("*.toml")))
        raise DataFileError(f"There is no {name_or_path!r} among the data files.", f"Use {names}, or a path.")
    return path


def load_vehicle(name_or_path: str | Path = "prototype") -> VehicleDescription:
    """Read a vehicle file, shipped (by name) or the user's own (by path).

    Raises:
        DataFileError: the file is missing, malformed, or describes what cannot be.
    """
    path = find_data_file("ident.vehicle", name_or_path)
    document = read_toml(path)
    quantities = read_quantities(require_table(document, "limits", path), LIMIT_UNITS, f"{path}: limits")
    limits = Limits(**{name: quantity.value for name, quantity in quantities.items()})
    _check_limits(limits, path)
    prior = read_parameters(path, "prior")
    _check_prior(prior, path)
    geometry = read_geometry(require_table(document, "geometry", path), path)
    refuse_unknown(document, KEYS, f"{path}:")
    return VehicleDescription(
        name=str(document.get("name", path.stem)),
        geometry=geometry,
        prior=prior,
        limits=limits,
        path=path,
    )


def _check_prior(prior: Parameters, path: Path) -> None:
    """Mass and inertias must be positive, friction may be zero: the excitation is planned with them."""
    for name, unit in PARAMETER_UNITS.items():
        inertial = unit.startswith("kg")
        if prior[name] < 0 or (inertial and prior[name] == 0):
            raise DataFileError(
                f"{path}: prior.{name} = {prior[name]} cannot be.",
                "It must be positive." if inertial else "It must not be negative.",
            )


def _check_limits(limits: Limits, path: Path) -> None:
    for name in LIMIT_UNITS:
        value = getattr(limits, name)
        if not (value > 0 and math.isfinite(value)):
            raise DataFileError(f"{path}: limits.{name} = {value} cannot be.", "It must be positive.")
    if limits.peak_torque < limits.rated_torque:
        raise DataFileError(
            f"{path}: limits.peak_torque = {limits.peak_torque} Nm is below the rated torque.",
            "Take both from the data sheet of the motor.",
        )
