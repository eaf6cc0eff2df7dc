"""What special rows of a vehicle are worth: the answers of an exam with each kind of them left out.

    quasiomni exam seal --out cases --first-seed 991000 --source emulator --engine pybullet --effects 24 --none 6 \
        --pairs 0 --laws 0 --unknown 0 --invisible 0 --faults 0
    python examples/without_special_rows.py cases more_cases --into rows.jsonl

What rattles, rests, wanders or gives way for a moment is not rolling as the equations say. Each kind is taken out of
the records in a module of its own; here that module finds nothing, and everything is answered once more, in every case
in which it had found something. Cases that the file has already are passed over. A case counts as right if
its first effect is the true one.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from hil.exam.answer_file import open_cases, own_key
from hil.exam.diagnosing import both_records, described, descriptions, vehicle_records
from hil.exam.folder import ExamFolder, read_exam
from ident.diagnosis.diagnosis import NamedEffect
from ident.diagnosis.vehicle import build
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.diagnosis.vehicle.records import loose, moments, sources
from ident.diagnosis.vehicle.records.signals import Signals

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Finder:
    """A function that finds special rows.

    Attributes:
        module, name: where it is looked up.
        nothing: what finds none, with the same arguments.
        is_something: whether a result says that there are some.
    """

    module: Any
    name: str
    nothing: Callable[..., Any]
    is_something: Callable[[Any], bool]


def _no_rattling(beta: Array, *_others: Any) -> tuple[Array, NDArray[np.bool_]]:
    return np.zeros(beta.shape), np.zeros(beta.shape, dtype=np.bool_)


def _everywhere(signals: Signals) -> NDArray[np.bool_]:
    return np.ones(len(signals.alpha), dtype=np.bool_)


USUAL: Final = "all of them"

KINDS: Final[Mapping[str, Sequence[Finder]]] = MappingProxyType(
    {
        "no motor rattles": (
            Finder(loose, "rattling", _no_rattling, lambda found: bool(found[1].any())),
            Finder(loose, "rattling_at_standstill", _no_rattling, lambda found: bool(found[1].any())),
        ),
        "no motor moves at rest": (
            Finder(loose, "moved_at_rest", lambda _beta, _near: np.zeros(2), lambda found: bool(found.any())),
        ),
        "no unit wanders": (Finder(sources, "wanders", lambda _across, _others: False, bool),),
        "no wheel gives way for a moment": (
            Finder(moments, "giving_way", lambda inputs, *_others: np.zeros(len(inputs), dtype=np.bool_), np.any),
        ),
        "steering counts however far": (
            Finder(loose, "near_middle", _everywhere, lambda found: not found.all()),
            Finder(sources, "near_middle", _everywhere, lambda found: not found.all()),
        ),
        "no wheel has slid": (
            Finder(
                build,
                "slid_by_any",
                lambda found, _context: [None for source in found for _ in source.coordinates],
                lambda found: any(one is not None for one in found),
            ),
        ),
    }
)
"""What is left out, and the functions that then find nothing."""


@contextmanager
def without(kind: str) -> Iterator[None]:
    """One kind of special rows left out."""
    with ExitStack() as stack:
        for one in KINDS[kind]:
            stack.enter_context(mock.patch.object(one.module, one.name, one.nothing))
        yield


@contextmanager
def noted(finding: set[str]) -> Iterator[None]:
    """Nothing is left out; kinds that find something are noted."""

    def looking(kind: str, one: Finder, usual: Callable[..., Any]) -> Callable[..., Any]:
        def look(*arguments: Any) -> Any:
            found = usual(*arguments)
            if one.is_something(found):
                finding.add(kind)
            return found

        return look

    with ExitStack() as stack:
        for kind, finders in KINDS.items():
            for one in finders:
                usual = looking(kind, one, getattr(one.module, one.name))
                stack.enter_context(mock.patch.object(one.module, one.name, usual))
        yield


def said_of(identifier: str, exam: Path) -> list[str]:
    """Names, places and first sizes that are said of a case, or its verdict where it has none."""
    folder = ExamFolder(exam)
    records = vehicle_records(*both_records(folder, identifier))
    found = diagnose_vehicle(records[:1], records[1:], *described(*descriptions(folder))).diagnosis
    return [_named(one) for one in found.effects] or [str(found.verdict)]


def _named(effect: NamedEffect) -> str:
    sizes = [f" = {one.value:.3g} ± {one.std:.2g} {one.unit}" for one in effect.parameters.values()]
    return f"{effect.name}@{effect.where}{''.join(sizes[:1])}"


def answers_of(identifier: str, exam: Path, kinds: Collection[str]) -> Iterator[tuple[str, list[str]]]:
    """What is said of a case with all rows, and without each of some kinds that finds something."""
    finding = set[str]()
    with noted(finding):
        said = said_of(identifier, exam)
    yield USUAL, said
    for kind in KINDS:
        if kind in finding and kind in kinds:
            with without(kind):
                yield kind, said_of(identifier, exam)


def truth_of(exam: Path, keys: Sequence[Path]) -> dict[str, str]:
    """First name of every case that was driven, `none` where nothing was put in."""
    folder = ExamFolder(exam)
    return {
        case.identifier: case.effects[0].name if case.effects else "none"
        for case in open_cases(folder, own_key(folder, read_exam(folder), keys))
        if folder.complete(case.identifier)
    }


def _names(line: Mapping[str, Any]) -> list[str]:
    """Without their sizes."""
    return [one.partition(" = ")[0] for one in line["said"]]


def _is_right(line: Mapping[str, Any]) -> bool:
    return bool(line["said"][0].partition("@")[0] == line["true"])


def table(lines: Sequence[Mapping[str, Any]]) -> str:
    """As a page of the documentation has it."""
    rows = [
        "| without | cases in which there are some | right with them | right without | others |",
        "|---|---|---|---|---|",
    ]
    said = {(line["kind"], line["identifier"]): line for line in lines}
    for kind in KINDS:
        pairs = [(said[USUAL, line["identifier"]], line) for line in lines if line["kind"] == kind]
        right = [sum(map(_is_right, column)) for column in zip(*pairs, strict=True)]
        other = [
            f"{line['true']}: {', '.join(_names(with_them))} -> {', '.join(_names(line))}"
            for with_them, line in pairs
            if _names(with_them) != _names(line)
        ]
        counts = " | ".join(map(str, right or [0, 0]))
        rows.append(f"| {kind} | {len(pairs)} | {counts} | {'; '.join(other)} |")
    return "\n".join(rows)


def main() -> None:
    """Every kind left out, case by case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exams", type=Path, nargs="+", help="of vehicles, whose answers are open")
    parser.add_argument("--key", type=Path, action="append", default=[], help="that an exam was sealed with")
    parser.add_argument("--kind", action="append", choices=KINDS, help="to leave out; default: each")
    parser.add_argument("--into", type=Path, required=True, help="lines of JSON, appended")
    asked = parser.parse_args()
    lines = [json.loads(line) for line in asked.into.read_text().splitlines()] if asked.into.exists() else []
    for exam in asked.exams:
        for identifier, true in truth_of(exam, asked.key).items():
            if any(line["identifier"] == identifier for line in lines):
                continue
            own = [
                {"kind": kind, "identifier": identifier, "exam": exam.name, "true": true, "said": said}
                for kind, said in answers_of(identifier, exam, asked.kind or KINDS)
            ]
            lines += own
            with asked.into.open("a", encoding="utf-8") as stream:
                stream.writelines(json.dumps(line) + "\n" for line in own)
    print(table(lines))


if __name__ == "__main__":
    main()
