"""What changes when a constant of the diagnosis is halved or doubled: the first names of the axes of an exam.

    quasiomni exam seal --out axes --first-seed 990000 --source axes --effects 20 --none 8 --pairs 6 --laws 6 \
        --unknown 0 --invisible 0 --faults 0
    python examples/halved_and_doubled.py axes --cases 12 --into constants.jsonl

A constant is a number, or a tuple of numbers, in capitals at the top of a module of the diagnosis. Whatever module has
taken it from there gets the other value as well. What is computed from it when modules are imported, or is the default
of an argument, does not follow. Lines that stand in the file already are not computed again.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pkgutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import ident.diagnosis
from hil.exam.diagnosing import axis_records
from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.axis.diagnose import diagnose_axis

FACTORS: Final = (0.5, 2.0)

ROOMS: Final = ("noise", "hypotheses", "evidence", "search", "answer", "check", "law", "observations", "axis")
"""Of the diagnosis whose constants are looked at: those of the vehicle act in no axis."""


@dataclass(frozen=True)
class Constant:
    """A number, or several, that somebody set.

    Attributes:
        module, name: where it stands.
        value: of it.
    """

    module: str
    name: str
    value: Any

    def times(self, factor: float) -> Any:
        """It halved or doubled; what counts stays whole, and at least one."""
        if isinstance(self.value, tuple):
            return tuple(_times(one, factor) for one in self.value)
        return _times(self.value, factor)

    @property
    def key(self) -> str:
        """Unique among all."""
        return f"{self.module.removeprefix('ident.diagnosis.')}.{self.name}"


def constants_of(rooms: Sequence[str] = ROOMS) -> Iterator[Constant]:
    """All constants of some rooms, where they are made."""
    for room in rooms:
        package = importlib.import_module(f"ident.diagnosis.{room}")
        for found in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
            module = importlib.import_module(found.name)
            source = Path(str(module.__file__)).read_text(encoding="utf-8")
            for name, value in vars(module).items():
                if name.isupper() and f"\n{name}: Final" in source and _is_number(value):
                    yield Constant(found.name, name, value)


@contextmanager
def changed(constant: Constant, factor: float) -> Iterator[None]:
    """The constant times a factor, in every module that has it."""
    holders = [
        module
        for name, module in list(sys.modules.items())
        if name.startswith(ident.diagnosis.__name__) and vars(module).get(constant.name) is constant.value
    ]
    for module in holders:
        setattr(module, constant.name, constant.times(factor))
    _forget()
    try:
        yield
    finally:
        for module in holders:
            setattr(module, constant.name, constant.value)
        _forget()


def _forget() -> None:
    """What functions of the diagnosis have kept, by the constants that were."""
    for name, module in list(sys.modules.items()):
        if name.startswith(ident.diagnosis.__name__):
            for value in vars(module).values():
                getattr(value, "cache_clear", lambda: None)()


def first_name(findings: Findings) -> str:
    """Name and place of the first of the answer, or the verdict where there is none."""
    if not findings.causes or not findings.verdict.explains:
        return str(findings.verdict)
    first = findings.causes[0]
    return first.candidate.key


def names_by(identifiers: Sequence[str], cases: Path) -> dict[str, str]:
    """First name of every case; what cannot be answered is an error by its kind."""
    found = {}
    for one in identifiers:
        fit, confirm = axis_records(*((cases / f"{one}.{which}.parquet").read_bytes() for which in ("fit", "confirm")))
        try:
            found[one] = first_name(diagnose_axis([fit], [confirm], seed=1))
        except (ArithmeticError, AssertionError, LookupError, TypeError, ValueError) as error:
            found[one] = type(error).__name__
    return found


def table(lines: Sequence[dict[str, Any]]) -> str:
    """As a page of the documentation has it."""
    rows = ["| constant | is | first names that change, halved; doubled |", "|---|---|---|"]
    by_key: dict[str, dict[float, dict[str, Any]]] = {}
    for line in lines:
        by_key.setdefault(line["constant"], {})[line["factor"]] = line
    for key, halves in by_key.items():
        counts = "; ".join(str(len(halves[factor]["changed"])) if factor in halves else "" for factor in FACTORS)
        rows.append(f"| `{key}` | {next(iter(halves.values()))['value']} | {counts} |")
    return "\n".join(rows)


def main() -> None:
    """Every constant, halved and doubled."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exam", type=Path, help="of axes")
    parser.add_argument("--cases", type=int, default=12, help="of it, the first ones")
    parser.add_argument("--into", type=Path, required=True, help="lines of JSON, appended")
    parser.add_argument("--only", default="", help="constants whose name holds this")
    asked = parser.parse_args()
    cases = asked.exam / "cases"
    identifiers = sorted({path.name.split(".")[0] for path in cases.glob("*.fit.parquet")})[: asked.cases]
    done = [json.loads(line) for line in asked.into.read_text().splitlines()] if asked.into.exists() else []
    if any(set(line["names"]) != set(identifiers) for line in done):
        parser.error(f"{asked.into} holds other cases: name another file, or as many cases as before.")
    usual = _kept(done, lambda: names_by(identifiers, cases), asked.into, "", 1.0, None)
    for constant in [one for one in constants_of() if asked.only in one.key]:
        for factor in FACTORS:
            with changed(constant, factor):
                _kept(
                    done, lambda: names_by(identifiers, cases), asked.into, constant.key, factor, constant.value, usual
                )
    print(table([line for line in done if line["constant"]]))


def _kept(
    done: list[dict[str, Any]],
    names: Callable[[], dict[str, str]],
    into: Path,
    key: str,
    factor: float,
    value: Any,
    usual: dict[str, str] | None = None,
) -> dict[str, str]:
    """First names by a constant, computed where they are not kept yet."""
    for line in done:
        if (line["constant"], line["factor"]) == (key, factor):
            return dict(line["names"])
    found = names()
    differing = [one for one, name in found.items() if usual is not None and usual[one] != name]
    line = {"constant": key, "factor": factor, "value": value, "changed": differing, "names": found}
    with into.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(line) + "\n")
    done.append(line)
    return found


def _times(value: float, factor: float) -> float:
    return max(1, round(value * factor)) if isinstance(value, int) else value * factor


def _is_number(value: Any) -> bool:
    """Zero has no half: it says which, not how much."""
    each = value if isinstance(value, tuple) else (value,)
    return any(each) and all(isinstance(one, int | float) and not isinstance(one, bool) for one in each)


if __name__ == "__main__":
    main()
