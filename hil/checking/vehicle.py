"""Whether vehicle file, network file and EDS files describe one vehicle, and what of it is assumed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from hil.checking.findings import Finding, Severity
from hil.describing.guesses import guess_priors
from hil.describing.measures import ASKED, DEFAULTS
from hil.network import Network
from hil.network.agreement import default_of, disagreements
from hil.network.cia import Index
from hil.network.described import Described
from ident.errors import DataFileError
from ident.vehicle.description import VehicleDescription
from ident.vehicle.quantities import read_toml

USUAL_RATIO: Final = 4.0
"""Factor by which a prior may differ from what is guessed from lengths, mass and rated torque, either way."""

EDS_RESERVE: Final = 1.01
"""Share of a limit in an EDS file that the vehicle file may ask for: rounding."""

_GUESSED: Final = ("assumed", "guess")
"""How the source of a number begins that nobody has measured."""


def check_vehicle(vehicle: VehicleDescription) -> Iterator[Finding]:
    """Numbers that such vehicles hardly have, and numbers that nobody has measured."""
    where = str(vehicle.path or vehicle.name)
    yield from _unusual_measures(vehicle, where)
    yield from _unusual_priors(vehicle, where)
    if vehicle.path is not None:
        yield from _unmeasured(vehicle.path)


def _unusual_measures(vehicle: VehicleDescription, where: str) -> Iterator[Finding]:
    for name, measure in (*ASKED.items(), *DEFAULTS.items()):
        table = "geometry" if hasattr(vehicle.geometry, name) else "limits"
        value = getattr(getattr(vehicle, table), name, None)
        if value is not None and not measure.low <= value <= measure.high:
            yield Finding(
                Severity.WARNING,
                "unusual",
                f"{where}: [{table}] {name}",
                f"{name} = {value:g} is not within {measure.low:g} to {measure.high:.4g}, which such vehicles have.",
                f"It is {measure.meaning.partition(';')[0]}, in {measure.unit}.",
            )


def _unusual_priors(vehicle: VehicleDescription, where: str) -> Iterator[Finding]:
    usual = guess_priors(vehicle.geometry, vehicle.prior["m_ch"], vehicle.limits.rated_torque)
    for name, guess in usual.items():
        value = vehicle.prior[name]
        ratio = value / guess.value
        if not 1 / USUAL_RATIO <= ratio <= USUAL_RATIO:
            yield Finding(
                Severity.WARNING,
                "unusual",
                f"{where}: [prior] {name}",
                f"{name} = {value:.4g} {guess.unit} is {ratio:.2g} times what lengths, mass and motors let expect, "
                f"{guess.value:.3g} {guess.unit}.",
                "Check it and its unit, m_ch, the lengths and rated_torque; leave it if it was measured.",
            )


def _unmeasured(path: Path) -> Iterator[Finding]:
    for table, entries in read_toml(path).items():
        names = [name for name, entry in _entries(entries) if str(entry.get("source", "")).startswith(_GUESSED)]
        if names:
            text = f"{', '.join(names)}: not measured, as the sources say."
            yield Finding(Severity.ASSUMED, "not_measured", f"{path}: [{table}]", text)


def _entries(table: Any) -> Iterator[tuple[str, Mapping[str, Any]]]:
    if isinstance(table, Mapping):
        yield from ((name, entry) for name, entry in table.items() if isinstance(entry, Mapping))


def check_agreement(vehicle: VehicleDescription | None, network: Network) -> Iterator[Finding]:
    """Numbers that two files state differently, and limits that an EDS file does not allow."""
    for found in disagreements(vehicle, network):
        yield Finding(Severity.ERROR, "disagreement", found.other.place, found.what, found.remedy)
    if vehicle is not None:
        yield from _beyond_eds(vehicle, network)


def _beyond_eds(vehicle: VehicleDescription, network: Network) -> Iterator[Finding]:
    limits = vehicle.limits
    asked = (
        ("peak_torque", limits.peak_torque, Index.MAX_TORQUE, limits.rated_torque / 1000.0, "Nm"),
        ("motor_speed", limits.motor_speed, Index.MAX_MOTOR_SPEED, math.tau / 60.0, "rad/s"),
    )
    for name, value, index, factor, unit in asked:
        for eds, dictionary in {node.eds: node.object_dictionary for node in network.drives}.items():
            allowed = (default_of(dictionary, index, 0) or math.inf) * factor
            if value > EDS_RESERVE * allowed:
                yield Finding(
                    Severity.WARNING,
                    "beyond_eds",
                    f"{vehicle.path}: [limits] {name}",
                    f"{name} = {value:.4g} {unit}, but the drive allows {allowed:.4g} {unit} ({eds}: default of "
                    f"{index:04X}h).",
                    "Correct the vehicle file, or the EDS file if the drive is set otherwise.",
                )


def check_rehearsal(described: Described) -> Iterator[Finding]:
    """What the emulator has to assume of the vehicle beyond its files."""
    from hil.bench.prototypes import derive_emulated  # a record can be checked where the emulator is not installed

    where = f"rehearsal of {described.vehicle.name}"
    try:
        lines = derive_emulated(described).assumed
    except DataFileError as error:
        yield Finding(Severity.WARNING, "no_rehearsal", where, error.what, error.remedy)
        return
    for line in lines:
        yield Finding(Severity.ASSUMED, "rehearsal", where, line)
