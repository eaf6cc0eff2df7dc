"""What special rows of a vehicle are worth: the answers of an exam with each kind of them left out.

    quasiomni exam seal --out cases --first-seed 991000 --source emulator --engine pybullet --effects 24 --none 6 \
        --pairs 0 --laws 0 --unknown 0 --invisible 0 --faults 0
    python examples/without_special_rows.py cases --into rows.jsonl

What rattles, rests, wanders or gives way for a moment is not rolling as the equations say. Each kind is taken out of
the records in a module of its own; here that module finds nothing, and everything is answered once more. Lines that
stand in the file already are not computed again. A case counts as right if its first effect is the true one.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final
from unittest import mock

import numpy as np

from hil.exam.diagnosing import described, vehicle_records
from ident.diagnosis.vehicle import build
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.diagnosis.vehicle.records import loose, sources

_NEVER: Final = {"new": lambda beta, *others: (np.zeros(beta.shape), np.zeros(beta.shape, dtype=np.bool_))}

KINDS: Final[Mapping[str, Sequence[tuple[Any, str, Any]]]] = MappingProxyType(
    {
        "all of them": (),
        "no motor rattles": (
            (loose, "rattling", _NEVER["new"]),
            (loose, "rattling_at_standstill", _NEVER["new"]),
        ),
        "no motor moves at rest": ((loose, "moved_at_rest", lambda beta, near: np.zeros(2)),),
        "no unit wanders": ((loose, "wandering", lambda *signals: None),),
        "no wheel gives way for a moment": (
            (build, "apart_from_moments", lambda found, geometry, processing: iter(found)),
        ),
        "steering counts however far": (
            (loose, "near_middle", lambda signals: np.ones(len(signals.alpha), dtype=np.bool_)),
            (sources, "near_middle", lambda signals: np.ones(len(signals.alpha), dtype=np.bool_)),
        ),
        "no wheel has slid": ((build, "slid_by_any", lambda found, context: _nothing(found)),),
    }
)
"""What is left out, and the functions that then find nothing."""


def _nothing(found: Sequence[sources.Source]) -> list[None]:
    return [None for source in found for _ in source.coordinates]


@contextmanager
def without(kind: str) -> Iterator[None]:
    """One kind of special rows left out."""
    with ExitStack() as stack:
        for module, name, replacement in KINDS[kind]:
            stack.enter_context(mock.patch.object(module, name, replacement))
        yield


def said_of(identifier: str, exam: Path) -> list[str]:
    """Names and places that are said of a case, or its verdict where it has none."""
    fit, confirm = ((exam / "cases" / f"{identifier}.{which}.parquet").read_bytes() for which in ("fit", "confirm"))
    records = vehicle_records(fit, confirm)
    texts = [(exam / name).read_text(encoding="utf-8") for name in ("vehicle.toml", "model.toml")]
    found = diagnose_vehicle(records[:1], records[1:], *described(texts[0], texts[1])).diagnosis
    return [f"{one.name}@{one.where}" for one in found.effects] or [str(found.verdict)]


def truth_of(exam: Path) -> dict[str, str]:
    """First name of every case, `none` where nothing was put in."""
    cases = json.loads((exam / "truth" / "answer.json").read_text(encoding="utf-8"))["cases"]
    return {one["identifier"]: one["effects"][0]["name"] if one["effects"] else "none" for one in cases}


def table(lines: Sequence[Mapping[str, Any]], truth: Mapping[str, str]) -> str:
    """As a page of the documentation has it."""
    rows = ["| without | right | other than with all of them |", "|---|---|---|"]
    said = {(line["kind"], line["identifier"]): line["said"] for line in lines}
    usual = next(iter(KINDS))
    for kind in KINDS:
        answered = {one: names for (of, one), names in said.items() if of == kind}
        right = sum(names[0].partition("@")[0] == truth[one] for one, names in answered.items())
        other = [
            f"{truth[one]}: {', '.join(said[usual, one])} -> {', '.join(names)}"
            for one, names in answered.items()
            if names != said[usual, one]
        ]
        rows.append(f"| {kind} | {right} of {len(answered)} | {'; '.join(other)} |")
    return "\n".join(rows)


def main() -> None:
    """Every kind left out, case by case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exam", type=Path, help="of a vehicle, whose answers are open")
    parser.add_argument("--into", type=Path, required=True, help="lines of JSON, appended")
    asked = parser.parse_args()
    truth = truth_of(asked.exam)
    lines = [json.loads(line) for line in asked.into.read_text().splitlines()] if asked.into.exists() else []
    done = {(line["kind"], line["identifier"]) for line in lines}
    for identifier in truth:
        for kind in KINDS:
            if (kind, identifier) not in done:
                with without(kind):
                    line = {"kind": kind, "identifier": identifier, "said": said_of(identifier, asked.exam)}
                lines.append(line)
                with asked.into.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps(line) + "\n")
    print(table(lines, truth))


if __name__ == "__main__":
    main()
