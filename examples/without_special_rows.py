"""What special rows of a vehicle are worth: the answers of an exam with each kind of them left out.

    quasiomni exam seal --out cases --first-seed 991000 --source emulator --engine pybullet --effects 24 --none 6 \
        --pairs 0 --laws 0 --unknown 0 --invisible 0 --faults 0
    python examples/without_special_rows.py cases more_cases --into rows.jsonl

What rattles, rests, wanders or gives way for a moment is not rolling as the equations say. Each kind is taken out of
the records in a module of its own; here that module finds nothing, and everything is answered once more, in every case
in which it had found something. Lines that stand in the file already are not computed again. A case counts as right if
its first effect is the true one.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final
from unittest import mock

import numpy as np

from hil.exam.answer_file import open_cases, own_key
from hil.exam.diagnosing import described, vehicle_records
from hil.exam.folder import RECORDS, ExamFolder, read_exam
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


@contextmanager
def noted(finding: set[str]) -> Iterator[None]:
    """Nothing is left out; kinds that find something are noted."""

    def looking(kind: str, usual: Callable[..., Any], replacement: Callable[..., Any]) -> Callable[..., Any]:
        def look(*arguments: Any) -> Any:
            found, nothing = (_kept(one(*arguments)) for one in (usual, replacement))
            if not _is_same(found, nothing):
                finding.add(kind)
            return found

        return look

    with ExitStack() as stack:
        for kind, functions in KINDS.items():
            for module, name, replacement in functions:
                usual = looking(kind, getattr(module, name), replacement)
                stack.enter_context(mock.patch.object(module, name, usual))
        yield


def _kept(values: Any) -> Any:
    return list(values) if isinstance(values, Iterator) else values


def _is_same(one: Any, other: Any) -> bool:
    if is_dataclass(one) and is_dataclass(other):
        return all(_is_same(getattr(one, each.name), getattr(other, each.name)) for each in fields(one))
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(map(_is_same, one, other))
    return one is other or (
        not isinstance(one, np.ndarray) and not isinstance(other, np.ndarray) and bool(one == other)
    )


def said_of(identifier: str, exam: Path) -> list[str]:
    """Names and places that are said of a case, or its verdict where it has none."""
    fit, confirm = ((exam / "cases" / f"{identifier}.{which}.parquet").read_bytes() for which in ("fit", "confirm"))
    records = vehicle_records(fit, confirm)
    texts = [(exam / name).read_text(encoding="utf-8") for name in ("vehicle.toml", "model.toml")]
    found = diagnose_vehicle(records[:1], records[1:], *described(texts[0], texts[1])).diagnosis
    return [f"{one.name}@{one.where}" for one in found.effects] or [str(found.verdict)]


def answers_of(identifier: str, exam: Path) -> Iterator[tuple[str, list[str]]]:
    """What is said of a case with all rows, and without each kind that finds something."""
    usual, finding = next(iter(KINDS)), set[str]()
    with noted(finding):
        said = said_of(identifier, exam)
    yield usual, said
    for kind in KINDS:
        if kind in finding:
            with without(kind):
                yield kind, said_of(identifier, exam)


def truth_of(exam: Path, keys: Sequence[Path]) -> dict[str, str]:
    """First name of every case that was driven, `none` where nothing was put in."""
    folder = ExamFolder(exam)
    return {
        case.identifier: case.effects[0].name if case.effects else "none"
        for case in open_cases(folder, own_key(folder, read_exam(folder), keys))
        if folder.record(case.identifier, RECORDS[-1]).exists()
    }


def _is_right(line: Mapping[str, Any]) -> bool:
    return bool(line["said"][0].partition("@")[0] == line["true"])


def table(lines: Sequence[Mapping[str, Any]]) -> str:
    """As a page of the documentation has it."""
    rows = [
        "| without | cases in which there are some | right with them | right without | others |",
        "|---|---|---|---|---|",
    ]
    usual = next(iter(KINDS))
    said = {(line["kind"], line["identifier"]): line for line in lines}
    for kind in KINDS:
        pairs = [(said[usual, line["identifier"]], line) for line in lines if line["kind"] == kind]
        right = [
            sum(line["said"][0].partition("@")[0] == line["true"] for line in column)
            for column in zip(*pairs, strict=True)
        ]
        other = [
            f"{line['true']}: {', '.join(with_them['said'])} -> {', '.join(line['said'])}"
            for with_them, line in pairs
            if with_them["said"] != line["said"]
        ]
        counts = " | ".join(map(str, right or [0, 0]))
        rows.append(f"| {kind} | {len(pairs)} | {counts} | {'; '.join(other)} |")
    return "\n".join(rows)


def main() -> None:
    """Every kind left out, case by case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exams", type=Path, nargs="+", help="of vehicles, whose answers are open")
    parser.add_argument("--key", type=Path, action="append", default=[], help="that an exam was sealed with")
    parser.add_argument("--into", type=Path, required=True, help="lines of JSON, appended")
    asked = parser.parse_args()
    lines = [json.loads(line) for line in asked.into.read_text().splitlines()] if asked.into.exists() else []
    for exam in asked.exams:
        for identifier, true in truth_of(exam, asked.key).items():
            if any(line["identifier"] == identifier for line in lines):
                continue
            own = [
                {"kind": kind, "identifier": identifier, "exam": exam.name, "true": true, "said": said}
                for kind, said in answers_of(identifier, exam)
            ]
            lines += own
            with asked.into.open("a", encoding="utf-8") as stream:
                stream.writelines(json.dumps(line) + "\n" for line in own)
    print(table(lines))


if __name__ == "__main__":
    main()
