"""The files of a vehicle, written from its measures: vehicle file, network file, EDS of drive and encoder."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

import jinja2

from hil.describing.guesses import guess_priors
from hil.describing.measures import ASKED, DEFAULTS, Measures
from hil.network import DEFAULT_NETWORK
from ident.errors import UserError
from ident.vehicle.description import LIMIT_UNITS
from ident.vehicle.geometry import GEOMETRY_UNITS, check_geometry
from ident.vehicle.quantities import Quantity
from ident.writing import write_whole

RATED_CURRENT: Final = 2.05
"""Of a servo for 200 V, per rated torque [A/Nm]."""

VELOCITY_BANDWIDTH: Final = 28.3
"""Of a drive's velocity loop, its gain over the load inertia [1/s]: as in the EDS that ships."""

_GEOMETRY_SOURCES: Final = dict.fromkeys(GEOMETRY_UNITS, "measured, as given") | {"gear_ratio": "data sheet, as given"}

_ASSUMPTIONS: Final = {
    "peak_torque": "assumed: three times the rated torque",
    "motor_speed": "assumed: 3000 rpm",
    "steering_limit": "assumed: stops a little beyond pi/2",
    "floor_friction": "assumed: rubber on sealed concrete, the low end",
    "floor_length": "assumed: what a campaign with lane change needs; measure the hall",
    "floor_width": "assumed: what a campaign with lane change needs; measure the hall",
}


def write_description(measures: Measures, vehicle_file: Path) -> tuple[Path, ...]:
    """Write the files of a vehicle; all of them, or none.

    Args:
        measures: of the vehicle.
        vehicle_file: to write; the others lie beside it and are named after it.

    Returns:
        The files: vehicle, network, drive EDS, encoder EDS.

    Raises:
        UserError: a file is there already or cannot be written, or no vehicle can have these lengths.
    """
    _check_name(vehicle_file)
    check_geometry(measures.geometry, vehicle_file)
    files = {vehicle_file.with_suffix(suffix): text(measures, vehicle_file.stem) for suffix, text in _TEXTS.items()}
    taken = [str(path) for path in files if path.exists() or path.is_symlink()]
    if taken:
        raise UserError(
            f"{', '.join(taken)} {'is' if len(taken) == 1 else 'are'} there already.",
            "Nothing was written: name another file, or move what is there.",
        )
    _write_all(files)
    return tuple(files)


def _check_name(path: Path) -> None:
    if path.suffix != ".toml" or not re.fullmatch(r"[\w-]+", path.stem):
        raise UserError(
            f"{path} is no name for a vehicle file.",
            "Name it like my_vehicle.toml: letters, digits, _ and -, because the vehicle is called by that name.",
        )


def _write_all(files: Mapping[Path, str]) -> None:
    written = []
    try:
        for path, text in files.items():
            write_whole(text, path)
            written.append(path)
    except UserError:
        for path in written:
            with suppress(OSError):
                path.unlink()
        raise


def _vehicle_text(measures: Measures, name: str) -> str:
    return _template("vehicle.toml.j2").render(
        name=name,
        network=f"{name}.network.toml",
        number=_number,
        geometry=_quantities(measures, GEOMETRY_UNITS),
        prior=guess_priors(measures.geometry, measures.mass, measures.rated_torque),
        limits=_quantities(measures, LIMIT_UNITS),
    )


def _quantities(measures: Measures, units: Mapping[str, str]) -> dict[str, Quantity]:
    return {name: Quantity(getattr(measures, name), unit, _source(name, measures)) for name, unit in units.items()}


def _source(name: str, measures: Measures) -> str:
    if name in measures.assumed:
        return _ASSUMPTIONS[name]
    return _GEOMETRY_SOURCES.get(name, f"as given: {(ASKED.get(name) or DEFAULTS[name]).meaning.partition(';')[0]}")


def _network_text(_measures: Measures, name: str) -> str:
    return _template("network.toml.j2").render(name=name, drive=f"{name}.drive.eds", encoder=f"{name}.encoder.eds")


def _drive_text(measures: Measures, name: str) -> str:
    """The shipped EDS of a drive with the ratings of this one, and its velocity loop tuned to the load, 60F9h."""
    text = DEFAULT_NETWORK.with_name("drive.eds").read_text(encoding="utf-8")
    permille = str(math.ceil(1000 * measures.peak_torque / measures.rated_torque))
    values = {
        "6072": permille,
        "6073": permille,
        "6075": str(round(1000 * RATED_CURRENT * measures.rated_torque)),
        "6076": str(round(1000 * measures.rated_torque)),
        "6080": str(math.ceil(measures.motor_speed * 60 / math.tau)),
        "60F9sub1": str(round(1e6 * VELOCITY_BANDWIDTH * _load_inertia(measures))),
        "60F9sub3": str(round(1e9 * _load_inertia(measures))),
    }
    for section, value in values.items():
        text = _with_entry(text, section, "DefaultValue", value)
    return _with_entry(text, "FileInfo", "FileName", f"{name}.drive.eds")


def _load_inertia(measures: Measures) -> float:
    """What a motor shaft accelerates in driving straight: a quarter of the vehicle, and its own parts [kg m^2]."""
    spin = guess_priors(measures.geometry, measures.mass, measures.rated_torque)["B_w"].value
    return (measures.mass * measures.wheel_radius**2 / 4 + spin) / measures.gear_ratio**2


def _encoder_text(_measures: Measures, name: str) -> str:
    text = DEFAULT_NETWORK.with_name("encoder.eds").read_text(encoding="utf-8")
    return _with_entry(text, "FileInfo", "FileName", f"{name}.encoder.eds")


def _with_entry(text: str, section: str, key: str, value: str) -> str:
    changed, count = re.subn(rf"(?ms)(^\[{section}\]$[^\[]*?^{key}=)[^\n]*", rf"\g<1>{value}", text, count=1)
    assert count == 1, f"the shipped EDS has no {key} in [{section}]"
    return changed


def _template(name: str) -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("hil.describing", "templates"),
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
        autoescape=False,
    )
    return environment.get_template(name)


def _number(value: float) -> str:
    """As TOML writes a float, without digits that mean nothing."""
    text = f"{value:.10g}"
    return text if set(text) & set(".e") else f"{text}.0"


_TEXTS: Final[Mapping[str, Callable[[Measures, str], str]]] = {
    ".toml": _vehicle_text,
    ".network.toml": _network_text,
    ".drive.eds": _drive_text,
    ".encoder.eds": _encoder_text,
}
"""Suffix of a file -> its text."""
