"""The table of what every experiment can see, split and place, for people.

`python -m ident.diagnosis.vehicle.experiment.visibility_table` writes `docs/visibility.md` anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.directions import VISIBLE
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC
from ident.diagnosis.vehicle.experiment.visibility import ALIKE, EXPERIMENTS, Sight, Visibility
from ident.effects import EFFECTS
from ident.vehicle.description import load_vehicle

Table = Mapping[str, Mapping[str, Sight]]
"""Sights by experiment and by key of a cause."""

_KINDS: Final = {
    "steering": "steering side",
    "wheel": "wheel",
    "wheels": "wheels",
    "drive": "drive",
    "encoder": "encoder",
}

_INTRODUCTION: Final = f"""# What an experiment can see, split and place

Computed from the equations for the shipped `prototype`, by rank: the columns of every cause are made orthogonal to
those of the eleven parameters, on ideal records of each experiment. Regenerate with
`python -m ident.diagnosis.vehicle.experiment.visibility_table`; a test compares this page with the equations.

- `-`: **invisible**. The parameters absorb the effect (they leave less than {VISIBLE:g} of its column).
- `seen`: visible, but another effect looks the same (cosine of the angle between what both leave above {ALIKE:g}).
- `split`: told apart from every other effect, but not its place from another place.
- `placed`: effect and place.

The first column of marks is the four steps of the campaign; each further one is these four together with one diagnostic
experiment. `slip` has no column of its own and depends on the floor, not on the equations; `payload` and a changed
parameter are refitted unless the model's values are given (`--model`).

"""


def visibility_table() -> Table:
    """All experiments for the shipped prototype."""
    visibility = Visibility(load_vehicle("prototype"))
    return {experiment: visibility[experiment] for experiment in EXPERIMENTS}


def table_text(table: Table) -> str:
    """The table as a page of the documentation."""
    lines = ["| effect | at | " + " | ".join(f"+ {name}" if name in DIAGNOSTIC else name for name in table) + " |"]
    lines.append("|" + "---|" * (2 + len(table)))
    for name, kind, keys in _row_keys(next(iter(table.values()))):
        marks = [_mark(name, keys, sights) for sights in table.values()]
        lines.append(f"| `{name}` | {kind} | " + " | ".join(marks) + " |")
    lines += ["", "## Sets that look the same in the four steps", ""]
    lines += [f"- {', '.join(f'`{key}`' for key in group)}" for group in _groups(table["four steps"])]
    lines += ["", "## The diagnostic experiments", ""]
    lines += [f"- **{name}**: {experiment.advice}." for name, experiment in DIAGNOSTIC.items()]
    return _INTRODUCTION + "\n".join(lines) + "\n"


def _row_keys(sights: Mapping[str, Sight]) -> list[tuple[EffectName, str, list[str]]]:
    found: dict[tuple[EffectName, str], list[str]] = {}
    for key in sights:
        name, _, where = key.partition("@")
        kind = _KINDS.get(where.partition("_")[0], where)
        found.setdefault((EffectName(name), kind), []).append(key)
    order = list(EFFECTS)
    return sorted(((name, kind, keys) for (name, kind), keys in found.items()), key=lambda row: order.index(row[0]))


def _mark(name: EffectName, keys: Sequence[str], sights: Mapping[str, Sight]) -> str:
    """The least of what is possible at the places of a kind."""
    entries = [sights[key] for key in keys]
    if not all(entry.visible for entry in entries):
        return "-"
    if any(entry.alike_effects() for entry in entries):
        return "seen"
    return "split" if any(entry.alike for entry in entries) else "placed"


def _groups(sights: Mapping[str, Sight]) -> list[tuple[str, ...]]:
    """Sets of causes that look the same, without repetition."""
    groups: list[tuple[str, ...]] = []
    for key, sight in sights.items():
        group = tuple(sorted((key, *sight.alike)))
        if sight.alike and group not in groups:
            groups.append(group)
    return groups


def main() -> None:
    """Write the page."""
    page = Path(__file__).resolve().parents[4] / "docs" / "visibility.md"
    page.write_text(table_text(visibility_table()), encoding="utf-8")


if __name__ == "__main__":
    main()
