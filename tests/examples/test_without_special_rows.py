"""What finds special rows finds none where it is left out, and the same as ever afterwards."""

from __future__ import annotations

import numpy as np
import pytest

from examples.without_special_rows import KINDS, USUAL, noted, table, without
from ident.diagnosis.vehicle.records import moments, sources


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_is_left_out_by_all_that_find_it(kind: str) -> None:
    before = [getattr(one.module, one.name) for one in KINDS[kind]]
    with without(kind):
        assert [getattr(one.module, one.name) for one in KINDS[kind]] == [one.nothing for one in KINDS[kind]]
    assert [getattr(one.module, one.name) for one in KINDS[kind]] == before


def test_what_finds_something_is_noted_and_finds_it() -> None:
    finding = set[str]()
    with noted(finding):
        assert not sources.wanders(1e-3, [1e-3])
        assert finding == set()
        assert sources.wanders(1e-3, [1e-6])
    assert finding == {"no unit wanders"}


def test_without_moments_no_wheel_gives_way() -> None:
    with without("no wheel gives way for a moment"):
        assert not np.any(moments.giving_way(np.ones((5, 3)), None, 0.01))  # type: ignore[arg-type]


def test_a_table_counts_what_is_right_with_and_without_and_names_what_differs_but_for_sizes() -> None:
    kind = "no motor rattles"
    said = {
        ("a", USUAL): ["backlash@drive_fl = 0.001 ± 0.0001 rad"],
        ("a", kind): ["slip@wheel_fl = 0.2 ± 0.1 1"],
        ("b", USUAL): ["slip@wheel_fl = 0.2 ± 0.1 1"],
        ("b", kind): ["slip@wheel_fl = 0.3 ± 0.1 1"],
    }
    true = {"a": "backlash", "b": "slip"}
    lines = [{"identifier": one, "kind": of, "said": names, "true": true[one]} for (one, of), names in said.items()]
    (row,) = [line for line in table(lines).splitlines() if kind in line]
    assert row == f"| {kind} | 2 | 2 | 1 | backlash: backlash@drive_fl -> slip@wheel_fl |"
