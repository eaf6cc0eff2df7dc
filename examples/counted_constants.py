"""Counts the constants of some packages, over syntax trees and data files: every one is a number that somebody set.

    python examples/counted_constants.py ident/diagnosis
    python examples/counted_constants.py ident/diagnosis/search

What counts, each number once wherever it stands:

- *module*: numbers in assignments of a module or a class whose name is in capitals: `GUARDS = (4.0, 2.0)` is two.
- *default*: numbers that a field of a class or an argument of a function has where none is given.
- *inline*: every other number in a statement.
- *data*: numbers in TOML and JSON files.

What does not count: 0, 1 and -1, and inline 2, -2, 0.5 and -0.5 as well; subscripts and slices; exponents; arguments
that say along which axis, or how something is laid out (`STRUCTURAL`); texts and documentation.
"""

from __future__ import annotations

import argparse
import ast
import enum
import json
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

TRIVIAL: Final = frozenset({0, 1, -1})
"""Numbers that say structure wherever they stand."""

INLINE_TRIVIAL: Final = TRIVIAL | {2, -2, 0.5, -0.5}
"""Those of a formula: a square, a half, both sides."""

STRUCTURAL: Final = frozenset({"axis", "ndim", "maxsize", "indent", "ndigits", "ddof", "deg"})
"""Arguments whose number is no choice about the world."""


class Place(enum.StrEnum):
    """Where a constant stands."""

    MODULE = "module"
    DEFAULT = "default"
    INLINE = "inline"
    DATA = "data"


def count_constants(path: Path) -> Counter[Place]:
    """Constants of one file by where they stand; none of a file that is neither source nor data.

    Args:
        path: of a Python, TOML or JSON file.
    """
    if path.suffix == ".py":
        return Counter(place for place, _ in constants_of(path.read_text(encoding="utf-8")))
    if path.suffix == ".toml":
        return Counter({Place.DATA: _count(tomllib.loads(path.read_text(encoding="utf-8")))})
    if path.suffix == ".json":
        return Counter({Place.DATA: _count(json.loads(path.read_text(encoding="utf-8")))})
    return Counter()


def constants_of(source: str) -> list[tuple[Place, float]]:
    """Every constant of a source, in order, and where it stands."""
    tree = ast.parse(source)
    found = _walk(tree, Place.INLINE)
    return [each for each in found if each[1] not in (INLINE_TRIVIAL if each[0] is Place.INLINE else TRIVIAL)]


def _walk(node: ast.AST, place: Place) -> Iterator[tuple[Place, float]]:
    number = _number(node)
    if number is not None:
        yield place, number
        return
    for child, inside in _children(node, place):
        yield from _walk(child, inside)


def _children(node: ast.AST, place: Place) -> Iterator[tuple[ast.AST, Place]]:
    """Parts of a node whose numbers count, and where they stand."""
    match node:
        case ast.Subscript():
            yield node.value, place
        case ast.BinOp(op=ast.Pow()):
            yield node.left, place
        case ast.keyword(arg=name, value=value):
            yield from [] if name in STRUCTURAL else [(value, place)]
        case ast.arguments():
            yield from ((default, Place.DEFAULT) for default in [*node.defaults, *node.kw_defaults] if default)
        case ast.Assign(targets=targets, value=value):
            yield value, Place.MODULE if any(map(_in_capitals, targets)) else place
        case ast.AnnAssign(target=target, value=ast.AST() as value):
            yield value, Place.MODULE if _in_capitals(target) else place
        case ast.ClassDef():
            yield from ((statement, Place.DEFAULT if _is_field(statement) else place) for statement in node.body)
        case _:
            yield from ((child, place) for child in ast.iter_child_nodes(node))


def _is_field(statement: ast.stmt) -> bool:
    """Whether a statement of a class is a field of it, that may have a default."""
    return isinstance(statement, ast.AnnAssign) and not _in_capitals(statement.target)


def _in_capitals(target: ast.AST) -> bool:
    return isinstance(target, ast.Name) and target.id.isupper()


def _number(node: ast.AST) -> float | None:
    """Of a literal, with its sign; None of anything else."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        inner = _number(node.operand)
        return None if inner is None else -inner
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        return float(node.value)
    return None


def _count(content: Any) -> int:
    """Numbers in what a data file holds that are not trivial."""
    if isinstance(content, dict):
        return sum(map(_count, content.values()))
    if isinstance(content, list):
        return sum(map(_count, content))
    return int(isinstance(content, int | float) and not isinstance(content, bool) and content not in TRIVIAL)


def files_of(paths: Sequence[Path]) -> list[Path]:
    """Sources and data files at or below some paths, in order."""
    found = [path for one in paths for path in ([one] if one.is_file() else sorted(one.rglob("*")))]
    return [path for path in found if path.suffix in (".py", ".toml", ".json")]


def table(paths: Sequence[Path]) -> str:
    """Constants of every file that has any, and of all of them."""
    counted = {path: count_constants(path) for path in files_of(paths)}
    total: Counter[Place] = sum(counted.values(), Counter())
    lines = ["| file | " + " | ".join(Place) + " | all |", "|---|" + "---|" * (len(Place) + 1)]
    rows = [(str(path), counts) for path, counts in counted.items() if counts]
    for name, counts in [*rows, ("all", total)]:
        lines.append(f"| {name} | " + " | ".join(str(counts[place]) for place in Place) + f" | {counts.total()} |")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("paths", nargs="+", type=Path, help="files or folders")
    print(table(parser.parse_args().paths))


if __name__ == "__main__":
    main()
