"""Rows that have nothing in common are problems of their own, and what is found of them is found of the whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hil.exam.sources.machine import Machine
from ident.diagnosis.answer.judge import answers_of, judge
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


def test_what_is_known_of_a_piece_is_not_asked_again(world: type[Any]) -> None:
    first, second = world(seed=2, true={"b": 0.4}), world(seed=3, true={"d": 0.8})
    whole = [beside(first.problem(part), second.problem(part)) for part in (0, 1)]
    before, stages = answers_of(*whole, seed=1), list[str]()
    known = {names: one for names, one in before.by_names.items() if names == first.problem(0).names}
    again = answers_of(*whole, seed=1, known=known, stage=stages.append)
    assert sum(stage.startswith("comparing") for stage in stages) == 1
    assert again.found[0] is before.found[0]
    assert again.findings().gap == before.findings().gap


def test_a_piece_that_nothing_explains_does_not_take_the_causes_of_another(world: type[Any]) -> None:
    known, unknown = world(seed=4, true={"b": 0.6}), world(seed=5, hidden=1.5)
    found = judge(*(beside(known.problem(part), unknown.problem(part)) for part in (0, 1)), seed=1)
    assert [cause.candidate.key for cause in found.causes] == ["b@place"]
    assert found.verdict == "effect"
    assert found.gap.closed < 0.5
    assert found.lacking


def test_of_two_records_of_two_axes_everything_stands_in_its_own_block(machine: Make) -> None:
    """Blocks of the pieces lie between each other, and parameters of the baseline as well."""
    made = machine(follower=(15.0, 3.0))
    fit, confirm = [made.drive(11), made.drive(13)], [made.drive(12)]
    problems = pose_axis(fit, confirm, axis_reference(fit, None, confirm))
    pieces = pieces_of(problems)
    assert [piece.blocks for piece in pieces] == [((0, 2), (0,)), ((1, 3), (1,))]
    assert "coupled_friction@axis_1<2" in {one.key for one in pieces[0].problems[0].candidates}
    found = judge(*problems, seed=1)
    assert "coupled_friction@axis_1<2" in {cause.candidate.key for cause in found.causes}
    blocks = [block for problem in problems for block in problem.blocks]
    for block, model in zip(blocks, found.after.blocks, strict=True):
        left = (block.target - model)[block.moving]
        assert np.std(left) < 0.1 * np.std(block.target[block.moving])
    for block, model in zip(problems[1].blocks, found.held_out.after, strict=True):
        assert np.std((block.target - model)[block.moving]) < 0.1 * np.std(block.target[block.moving])
    for block, before in zip(blocks, found.before.blocks, strict=True):
        # Causes of a piece are in its blocks alone, so that without them the model is its own baseline.
        assert np.allclose(before, block.baseline @ found.before.baseline)
    for cause in found.causes:
        axis = int(cause.candidate.where.removeprefix("axis_")[0]) - 1
        assert all(added is None for added in cause.part.added[1 - axis :: 2])


def test_what_a_cause_adds_in_its_piece_is_what_it_adds_in_the_whole(machine: Make) -> None:
    made = machine(follower=(15.0, 3.0))
    fit, confirm = [made.drive(11)], [made.drive(12)]
    problems = pose_axis(fit, confirm, axis_reference(fit, None, confirm))
    for piece in pieces_of(problems):
        (number,) = piece.blocks[0]
        for candidate in piece.problems[0].candidates:
            if candidate.contribution is not None and candidate.variants[0].columns[0] is not None:
                values = candidate.variants[0].numbers(np.full(candidate.variants[0].columns[0].shape[1], 1e-3))
                whole = problems[0].candidate(candidate.key).contribution
                assert whole is not None
                (added,) = candidate.contribution(values, np.ones(len(piece.parameters)))
                expected = whole(values, np.ones(len(problems[0].names)))[number]
                np.testing.assert_array_equal(added, expected)


def test_a_name_is_invisible_if_no_piece_that_has_it_shows_it(world: type[Any]) -> None:
    first, second = world(seed=2), world(seed=3, names=("a", "b", "gone"))

    def absorbed(problem: Problem) -> Problem:
        columns = tuple(block.baseline[:, :1] for block in problem.blocks)
        hidden = [replace(one, variants=(Variant(columns),)) for one in problem.candidates if one.effect == "gone"]
        return replace(problem, candidates=(*(one for one in problem.candidates if one.effect != "gone"), *hidden))

    whole = [beside(first.problem(part), absorbed(second.problem(part))) for part in (0, 1)]
    assert judge(*whole, seed=1).invisible == ("gone",)
