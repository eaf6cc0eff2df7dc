"""A variant of a step is driven like the step that it is named after."""

from __future__ import annotations

import pytest

from ident.records.record import Step, base_step


@pytest.mark.parametrize("step", list(Step))
def test_every_step_is_its_own_base(step: Step) -> None:
    assert base_step(step) is step


@pytest.mark.parametrize(
    ("name", "base"),
    [
        ("straight_dither", Step.STRAIGHT),
        ("straight_turned", Step.STRAIGHT),
        ("steering_left_slow", Step.STEERING_LEFT),
        ("wheel_lifted_fl", Step.WHEEL_LIFTED),
        ("lane_change_loaded", Step.LANE_CHANGE),
    ],
)
def test_a_variant_has_the_base_that_it_is_named_after(name: str, base: Step) -> None:
    assert base_step(name) is base


@pytest.mark.parametrize("name", ["straighten", "parking", "steering", "my_straight"])
def test_other_names_have_no_base(name: str) -> None:
    assert base_step(name) is None
