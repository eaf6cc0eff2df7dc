"""Rows that have nothing in common are problems of their own, and what is found of them is found of the whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hil.exam.sources.machine import Machine
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.axis.diagnose import pose_axis
from ident.diagnosis.axis.reference import axis_reference
from ident.diagnosis.observations.pieces import pieces_of
from ident.diagnosis.problem import Problem, Variant

Array = NDArray[np.float64]
Make = Callable[..., Machine]


def beside(first: Problem, second: Problem) -> Problem:
    """Two problems as one: parameters, candidates and blocks of the second behind those of the first."""
    widths = len(first.names), len(second.names)

    def padded(baseline: Array, before: int, after: int) -> Array:
        return np.pad(baseline, ((0, 0), (before, after)))

    def moved(variant: Variant, before: int, after: int) -> Variant:
        return replace(variant, columns=(*[None] * before, *variant.columns, *[None] * after))

    counts = len(first.blocks), len(second.blocks)
    blocks = [replace(block, baseline=padded(block.baseline, 0, widths[1])) for block in first.blocks]
    blocks += [
        replace(block, baseline=padded(block.baseline, widths[0], 0), coordinate=f"{block.coordinate}2")
        for block in second.blocks
    ]
    candidates = [
        replace(one, variants=tuple(moved(v, 0, counts[1]) for v in one.variants)) for one in first.candidates
    ]
    candidates += [
        replace(one, where="elsewhere", variants=tuple(moved(v, counts[0], 0) for v in one.variants))
        for one in second.candidates
    ]
    names = (*first.names, *(f"{name}2" for name in second.names))
    return Problem(names, (*first.units, *second.units), tuple(blocks), tuple(candidates))


def test_rows_that_share_a_parameter_are_one_piece(world: type[Any]) -> None:
    one = world(seed=1)
    (piece,) = pieces_of((one.problem(0), one.problem(1)))
    assert piece.blocks == ((0, 1), (0, 1))
    assert [candidate.key for candidate in piece.problems[0].candidates] == [
        candidate.key for candidate in one.problem(0).candidates
    ]


def test_what_two_worlds_lack_is_found_in_both_as_in_each(world: type[Any]) -> None:
    first, second = world(seed=2, true={"b": 0.4}), world(seed=3, true={"d": 0.8})
    whole = [beside(first.problem(part), second.problem(part)) for part in (0, 1)]
    pieces = pieces_of(whole)
    assert [piece.blocks for piece in pieces] == [((0, 1), (0, 1)), ((2, 3), (2, 3))]
    assert [piece.parameters.tolist() for piece in pieces] == [[0, 1, 2], [3, 4, 5]]
    found = judge(*whole, seed=1)
    each = [judge(one.problem(0), one.problem(1), seed=1) for one in (first, second)]
    assert {cause.candidate.key for cause in found.causes} == {"b@place", "d@elsewhere"}
    np.testing.assert_allclose(
        found.after.baseline, np.concatenate([one.after.baseline for one in each]), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(found.after.blocks[2], each[1].after.blocks[0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.held_out.after[3], each[1].held_out.after[1], rtol=1e-9, atol=1e-12)
    before = [one.gap.before for one in each]
    assert found.gap.before == pytest.approx(np.sqrt(np.mean(np.square(before))))
    assert sum(share.share for share in found.where if share.region == "all") == pytest.approx(1.0)
    late = next(cause for cause in found.causes if cause.candidate.where == "elsewhere")
    assert [one is None for one in late.part.added] == [True, True, False, False, True, True, False, False]


def test_a_piece_that_nothing_explains_does_not_take_the_causes_of_another(world: type[Any]) -> None:
    known, unknown = world(seed=4, true={"b": 0.6}), world(seed=5, hidden=1.5)
    found = judge(*(beside(known.problem(part), unknown.problem(part)) for part in (0, 1)), seed=1)
    assert [cause.candidate.key for cause in found.causes] == ["b@place"]
    assert found.verdict == "effect"
    assert found.gap.closed < 0.5
    assert found.lacking


def test_every_axis_of_a_robot_is_a_piece_whatever_moves_in_its_rows(machine: Make) -> None:
    made = machine(follower=(15.0, 3.0))
    fit, confirm = [made.drive(11)], [made.drive(12)]
    pieces = pieces_of(pose_axis(fit, confirm, axis_reference(fit, None, confirm)))
    assert len(pieces) == len(fit[0].axes) == 2
    assert "coupled_friction@axis_1<2" in {one.key for one in pieces[0].problems[0].candidates}
    for piece in pieces:
        (block,) = piece.problems[0].blocks
        for candidate in piece.problems[0].candidates:
            if candidate.contribution is not None:
                values = candidate.variants[0].numbers(np.full(np.shape(candidate.variants[0].columns[0])[1], 1e-3))
                (added,) = candidate.contribution(values, np.ones(len(piece.parameters)))
                assert added is None or len(added) == len(block.target)
