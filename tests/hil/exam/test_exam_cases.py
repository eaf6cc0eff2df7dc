"""What an exam asks: balanced over effects and sizes, in an order that tells nothing."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from emulator.effects import inject
from emulator.prototype import load_prototype
from hil.exam.cases import SIZES, Case, Kind, case_from_json
from hil.exam.drawing import Composition, draw_cases
from hil.exam.sealing import VehicleOrder, effect_of, seal
from hil.exam.sizes import EffectSize, SizeTable, beyond_sampling, load_rows, load_sizes, table_text
from hil.exam.world import stored_model, stored_sizes
from hil.exam.worlds import world_of
from ident.diagnosis.names import EffectName, places_of
from ident.effects import EFFECTS
from ident.errors import UserError

PROTOTYPE = world_of("prototype", None)


def test_there_are_as_many_of_each_kind_as_asked_for(cases: list[Case]) -> None:
    counts = Counter(case.kind for case in cases)
    assert counts == {
        Kind.EFFECT: 240,
        Kind.PAIR: 24,
        Kind.NONE: 60,
        Kind.UNKNOWN: 40,
        Kind.INVISIBLE: 24,
        Kind.LAW: 32,
        Kind.FAULT: 16,
    }


def test_effects_and_sizes_are_balanced(cases: list[Case], table: SizeTable) -> None:
    singles = [case for case in cases if case.kind is Kind.EFFECT]
    names = Counter(case.effects[0].name for case in singles)
    assert set(names) == {row.name for row in table.visible}
    assert max(names.values()) - min(names.values()) <= 1
    sizes = Counter(case.noise_units for case in singles)
    assert set(sizes) == set(SIZES)
    assert max(sizes.values()) - min(sizes.values()) <= 2
    for name in names:
        held = Counter(case.noise_units for case in singles if case.effects[0].name == name)
        assert max(held.values()) - min(held.values()) <= 1


def test_every_effect_of_the_library_is_in_the_table_at_every_place(table: SizeTable) -> None:
    listed = {(row.name, row.where) for row in (*table.visible, *table.invisible)}
    assert listed == {(str(name), where) for name in EffectName for where in places_of(name)}


def test_effects_of_drive_floor_and_chassis_have_no_candidate(table: SizeTable) -> None:
    assert {row.name for row in table.unknown} == {"field_weakening", "floor_waves", "hose_spring"}
    assert not {row.name for row in table.unknown} & {str(name) for name in EFFECTS}


def test_the_emulator_can_have_every_effect_that_is_drawn(cases: list[Case]) -> None:
    prototype = load_prototype()
    for case in cases:
        if case.kind not in (Kind.LAW, Kind.FAULT):
            inject(prototype, [effect_of(injected) for injected in case.effects], 1e-3)


def test_identifiers_are_unique_and_seeds_are_not_shared(cases: list[Case]) -> None:
    assert len({case.identifier for case in cases}) == len(cases)
    seeds = [seed for case in cases for seed in (case.seed, case.seed + 1)]
    assert len(set(seeds)) == len(seeds)
    assert min(seeds) == 500_001


def test_the_order_tells_nothing_of_the_kind(cases: list[Case]) -> None:
    """Runs test: the number of changes between `none` and others is that of a shuffled sequence."""
    is_none = np.array([case.kind is Kind.NONE for case in cases])
    runs = 1 + int(np.sum(is_none[1:] != is_none[:-1]))
    n, m = int(is_none.sum()), int((~is_none).sum())
    mean = 1 + 2 * n * m / (n + m)
    deviation = np.sqrt((mean - 1) * (mean - 2) / (n + m - 1))
    assert abs(runs - mean) < 4 * deviation


def test_two_effects_of_a_pair_have_different_names(cases: list[Case]) -> None:
    pairs = [case for case in cases if case.kind is Kind.PAIR]
    assert all(len({effect.name for effect in case.effects}) == 2 for case in pairs)


def test_a_case_survives_being_written(cases: list[Case]) -> None:
    assert [case_from_json(case.as_json()) for case in cases] == cases


def test_a_size_goes_through_the_points_measured() -> None:
    row = EffectSize("x", "y", "z", "1", "torque", ((0.1, 1.0), (0.4, 4.0), (0.5, 8.0)), 1.0, False, True)
    assert row.physical(4.0) == pytest.approx(0.4)
    assert row.physical(2.0) == pytest.approx(0.2)
    assert row.physical(0.5) == pytest.approx(0.05)


def test_a_lag_of_all_drives_counts_from_what_sampling_may_do_and_nothing_else_does() -> None:
    table = load_sizes(PROTOTYPE.sizes_file)
    drawn = beyond_sampling(table, 4e-3)
    moved = {
        (row.name, row.where): further.physical(1.0) - row.physical(1.0)
        for row, further in zip(table.visible, drawn.visible, strict=True)
        if further != row
    }
    assert moved == {(name, "drives"): pytest.approx(2.2e-3) for name in ("time_delay", "torque_filter")}
    assert table_text(drawn.visible) == table_text(table.visible)


def test_a_table_has_an_effect_a_line_and_is_read_back_as_it_was(tmp_path: Path) -> None:
    kept = PROTOTYPE.sizes_file
    rows = load_rows(kept)
    assert table_text(rows) == kept.read_text()
    assert len(kept.read_text().splitlines()) == len(rows) + 2
    again = tmp_path / "sizes.json"
    again.write_text(table_text(rows))
    assert load_rows(again) == rows


def test_a_world_without_a_table_or_a_model_says_what_writes_them(tmp_path: Path) -> None:
    assert stored_sizes(PROTOTYPE, None).is_file()
    assert stored_model(PROTOTYPE, None).is_file()
    own = world_of(str(tmp_path / "own.toml"), None)
    for stored, words in (
        (stored_sizes, "exam calibrate --vehicle .*own.toml --engine .* --out"),
        (stored_model, "--model"),
    ):
        with pytest.raises(UserError) as caught:
            stored(own, None)
        assert re.search(words, caught.value.remedy)
        assert stored(own, tmp_path / "named") == tmp_path / "named"


def test_a_kind_without_effects_is_refused(table: SizeTable) -> None:
    with pytest.raises(UserError, match="no effect of a kind"):
        draw_cases(
            SizeTable((), (), ()), Composition(4, 0, 0, 0, 0, 0, 0), range(9).__getitem__, np.random.default_rng(0)
        )


def test_every_excitation_is_driven_as_often_as_another(cases: list[Case]) -> None:
    driven = Counter(case.excitation for case in cases)
    assert set(driven) == set(range(Composition().excitations))
    assert max(driven.values()) - min(driven.values()) <= 1


def test_no_kind_of_case_keeps_to_a_few_excitations(cases: list[Case]) -> None:
    for kind in Kind:
        own = [case.excitation for case in cases if case.kind is kind]
        assert len(set(own)) > min(len(own), Composition().excitations) / 2


def test_an_exam_has_no_more_excitations_than_cases(table: SizeTable) -> None:
    few = Composition(effects=2, pairs=0, none=1, unknown=0, invisible=0, laws=0, faults=0)
    assert few.driven == 3
    assert {case.excitation for case in draw_cases(table, few, range(9).__getitem__, np.random.default_rng(1))} == {
        0,
        1,
        2,
    }


def test_an_exam_without_cases_is_refused_before_anything_is_planned(table: SizeTable, tmp_path: Path) -> None:
    order = VehicleOrder(
        tmp_path / "exam", Composition(0, 0, 0, 0, 0, 0, 0), None, 1, 1, None, PROTOTYPE, PROTOTYPE.model_file
    )
    with pytest.raises(UserError, match="without cases"):
        seal(order, table, lambda *_: None)
    assert not order.out.exists()
