"""A constant is a number that somebody set: it is counted once, where it stands, and structure is not counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from examples.counted_constants import Place, constants_of, count_constants, table


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("GUARDS = (4.0, 2.0, 1)", [(Place.MODULE, 4.0), (Place.MODULE, 2.0)]),
        ("LEAST: Final = 1e-6", [(Place.MODULE, 1e-6)]),
        ("class A:\n    size: float = 0.25", [(Place.DEFAULT, 0.25)]),
        ("class A:\n    SIZE: float = 0.25", [(Place.MODULE, 0.25)]),
        ("def f(x: float = 3.0, *, y=0.1): return x", [(Place.DEFAULT, 3.0), (Place.DEFAULT, 0.1)]),
        ("def f(x):\n    return x if x > 1.3 else -4", [(Place.INLINE, 1.3), (Place.INLINE, -4.0)]),
    ],
)
def test_a_number_counts_where_it_stands(source: str, expected: list[tuple[Place, float]]) -> None:
    assert constants_of(source) == expected


@pytest.mark.parametrize(
    "source",
    [
        "x = y[3:7]",
        "x = y**4",
        "x = y.sum(axis=3)",
        "x = 0.5 * y - 2 * z + 1",
        "X = True",
        '"""Of 0.7."""',
        "x = 'a 9'",
    ],
)
def test_structure_is_no_constant(source: str) -> None:
    assert constants_of(source) == []


def test_numbers_of_data_files_count_and_so_do_those_of_lists(tmp_path: Path) -> None:
    data = tmp_path / "odds.json"
    data.write_text('{"odds": [0.1, 0.9, 1], "name": "0.3", "on": true}')
    assert count_constants(data) == {Place.DATA: 2}
    limits = tmp_path / "limits.toml"
    limits.write_text("far = 2.5\n[inner]\nlaw = 0.12\n")
    assert count_constants(limits) == {Place.DATA: 2}


def test_the_table_sums_what_every_file_has(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("A = 3.0\n")
    (tmp_path / "b.py").write_text("def f(x=4.0): return 5 * x\n")
    (tmp_path / "c.py").write_text("x = 0\n")
    lines = table([tmp_path]).splitlines()
    assert lines[-1] == "| all | 1 | 1 | 1 | 0 | 3 |"
    assert not any("c.py" in line for line in lines)
