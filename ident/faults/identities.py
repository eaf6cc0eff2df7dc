"""Which faults are the same in the records of an experiment: computed on ideal records of the plain model.

`python -m ident.faults.identities` prints the table of docs/faults.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from ident.diagnosis.vehicle.experiment.ideal import FOUR, Drive, ideal_record
from ident.faults.channels import GROUPS, pairs, single, whole
from ident.faults.evidence import Evidence
from ident.faults.fault import FaultName
from ident.faults.find import RIVALS
from ident.faults.hypothesis import Hypothesis
from ident.faults.reduced import reduced
from ident.faults.search import least_gain, searched
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription, load_vehicle

TIMES: Final = 3.0
"""Factor of the scaled channels of the table."""

EXPERIMENTS: Final[Mapping[str, Sequence[Drive]]] = MappingProxyType(
    {
        "straight": (Drive(Step.STRAIGHT),),
        "steering_left": (Drive(Step.STEERING_LEFT),),
        "four steps": FOUR,
    }
)
"""Steps that are driven."""


def faults_to_try() -> list[Hypothesis]:
    """Every pair swapped, every channel and group negated and scaled."""
    found = []
    for group in GROUPS:
        places = [*(single(group, column) for column in range(len(group.members))), whole(group)]
        found += [Hypothesis(FaultName.SWAPPED, place) for place in pairs(group)]
        found += [Hypothesis(FaultName.NEGATED, place) for place in places]
        found += [Hypothesis(FaultName.SCALED, place, "", TIMES) for place in places]
    return found


def set_of(fault: Hypothesis, sound: Evidence) -> tuple[str, ...] | None:
    """Names that a record with a fault bears alike; None where it does not show.

    Args:
        fault: that is put into the record.
        sound: an ideal record.
    """
    inverse = replace(fault, value=1 / fault.value) if fault.name is FaultName.SCALED else fault
    evidence = Evidence(inverse.undone(sound.segments), sound.vehicle)
    found = searched(evidence)
    if not found or evidence.loss - found[0].loss < least_gain(evidence):
        return None
    return tuple(dict.fromkeys(each.hypothesis.key for each in found if each.loss < found[0].loss + RIVALS))


def identities(vehicle: VehicleDescription) -> dict[str, dict[str, tuple[str, ...] | None]]:
    """Sets by experiment and fault."""
    return {
        experiment: {
            fault.key: set_of(fault, Evidence([low for _, low in reduced(record.segments)], vehicle))
            for fault in faults_to_try()
        }
        for experiment, record in ((name, ideal_record(drives, vehicle)) for name, drives in EXPERIMENTS.items())
    }


def table_text(table: Mapping[str, Mapping[str, tuple[str, ...] | None]]) -> str:
    """As a table of the documentation."""
    lines = ["| fault | " + " | ".join(table) + " |", "|" + "---|" * (1 + len(table))]
    for key in next(iter(table.values())):
        lines.append(f"| `{key}` | " + " | ".join(_mark(key, sets[key]) for sets in table.values()) + " |")
    return "\n".join(lines)


def _mark(key: str, names: tuple[str, ...] | None) -> str:
    if names is None:
        return "–"
    others = [f"`{name}`" for name in names if name != key]
    if key not in names:
        return "taken for " + ", ".join(others)
    return "= " + ", ".join(others) if others else "named"


if __name__ == "__main__":
    print(table_text(identities(load_vehicle("prototype"))))  # noqa: T201
