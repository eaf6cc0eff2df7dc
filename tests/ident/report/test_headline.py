"""The first line of an answer: the cause with its number, and never that all is well over a step that is not."""

from __future__ import annotations

import string
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ident.diagnosis.diagnosis import Alternative, Diagnosis, Gap, LawAnswer, NamedEffect, Unseen, Verdict
from ident.diagnosis.vehicle.unseen import LANE_CHANGE, REPEATED
from ident.effects import EFFECTS
from ident.plant.places import CHASSIS, DRIVES, ENCODERS, GROUPS, STEERING, WHEEL_PLACES
from ident.report.gap_summary import cause_line, next_text
from ident.report.headline import ABOVE, effect_words, headline, place_words
from ident.vehicle.quantities import Quantity

STICKS = NamedEffect(
    "stribeck",
    "steering_left",
    {"amplitude": Quantity(6.11, "Nm", "", 0.06), "velocity": Quantity(0.303, "rad/s", "", 0.003)},
    0.95,
    ("stribeck",),
    0.98,
)


def answer(verdict: Verdict, effects: Sequence[NamedEffect], *unseen: tuple[str, str, float, float]) -> Diagnosis:
    gaps = tuple(Unseen(step, channel, Gap(before, after, 1.0)) for step, channel, before, after in unseen)
    return Diagnosis(verdict, tuple(effects), (), Gap(5.0, 1.01, 1.0), (), None, gaps)


def test_a_cause_is_said_with_its_number_and_how_much_of_the_gap_it_explains() -> None:
    held_out = (REPEATED, "dynamic", 5.0, 1.02)
    text = headline(answer(Verdict.EFFECT, [STICKS], held_out, (LANE_CHANGE, "dynamic", 4.0, 1.2)))
    assert text == (
        "Steering left: 6.110 ± 0.060 Nm more friction at rest, most of it gone above 0.3030 ± 0.0030 rad/s. "
        "It explains 100 % of the gap; what is left is noise."
    )


def test_where_else_a_cause_may_be_is_said_without_its_number() -> None:
    """What people go to look at is the place; of an encoder at the other side the angle has the other sign."""
    angle = {"offset": Quantity(3.1e-4, "rad", "", 2e-5)}
    offset = NamedEffect("steering_offset", "steering_left", angle, 0.97, ("steering_offset",), 0.98)
    right = Alternative("steering_offset", None, "steering_right")
    effect = replace(offset, alternatives=(right, Alternative("wheel_radius", None, "wheel_fl")))
    held_out = (REPEATED, "dynamic", 5.0, 1.02)
    alone, text = (headline(answer(Verdict.EFFECT, [one], held_out)) for one in (offset, effect))
    said, rest = alone.split(". It explains")
    assert text == f"{said} (or it is at steering right, by another number). It explains{rest}"
    assert cause_line(effect).endswith("; might as well be at steering_right")


def test_a_cause_that_may_be_none_of_the_library_is_said_to_be() -> None:
    doubted = replace(STICKS, probability=0.5, ambiguity_set=("stribeck", "law"))
    assert cause_line(doubted).endswith("; might as well be something without a name")


def test_of_many_other_places_the_first_line_says_how_many() -> None:
    wheels = tuple(Alternative("stribeck", None, wheel) for wheel in WHEEL_PLACES)
    text = headline(answer(Verdict.EFFECT, [replace(STICKS, alternatives=wheels)], (REPEATED, "dynamic", 5.0, 1.02)))
    assert "(or it is at one of 4 other places, by another number)" in text


def test_what_a_cause_leaves_of_the_worst_step_is_in_the_same_line() -> None:
    lane = (LANE_CHANGE, "dynamic", 4.67, 2.79)
    text = headline(answer(Verdict.EFFECT, [STICKS], (REPEATED, "dynamic", 5.0, 1.02), lane))
    closed = 1 - (2.79**2 - 1) / (4.67**2 - 1)
    assert f"It explains {100 * closed:.0f} % of the gap of the torques of the lane change" in text
    assert "they stay at 2.8 times the noise, and that has no cause yet" in text


def test_what_a_cause_cannot_explain_is_said_beside_what_it_does() -> None:
    lane = [(LANE_CHANGE, "dynamic", 3.7, 3.1), (LANE_CHANGE, "kinematic", 3.4, 3.4)]
    text = headline(answer(Verdict.EFFECT, [STICKS], (REPEATED, "dynamic", 5.0, 1.02), *lane))
    assert "of the gap of the torques of the lane change" in text
    assert "its rolling constraints stay at 3.4 times the noise" in text
    none = headline(answer(Verdict.EFFECT, [STICKS], (REPEATED, "dynamic", 5.0, 1.02), lane[1]))
    assert "of the gap of the other steps. But the rolling constraints of the lane change are at 3.4" in none
    assert " 0.00 %" not in text + none


@pytest.mark.parametrize("step", [REPEATED, LANE_CHANGE])
@pytest.mark.parametrize("channel", ["kinematic", "dynamic", "outcome"])
def test_nothing_is_missing_only_where_no_held_out_step_is_above_its_noise(step: str, channel: str) -> None:
    others = [(s, c, 1.0, 1.0) for s in (REPEATED, LANE_CHANGE) for c in ("kinematic", "dynamic", "outcome")]
    quiet = headline(answer(Verdict.NONE, [], *others, (step, channel, 0.99 * ABOVE, 0.99 * ABOVE)))
    assert quiet.startswith("Nothing is missing: what is left is noise")
    loud = headline(answer(Verdict.NONE, [], *others, (step, channel, 3.1, 3.1)))
    assert "3.1 times the noise" in loud
    assert "is noise" not in loud


def test_an_unknown_cause_is_said_with_the_step_that_shows_it() -> None:
    text = headline(answer(Verdict.UNKNOWN, [], (LANE_CHANGE, "kinematic", 4.0, 4.0)))
    assert text.startswith("Something is missing")
    assert "rolling constraints of the lane change are at 4.0 times the noise" in text


def test_causes_beyond_two_are_counted() -> None:
    others = [replace(STICKS, where=where) for where in ("steering_right", "wheel_fl", "wheel_rr")]
    text = headline(answer(Verdict.EFFECT, [STICKS, *others]))
    assert "Steering left:" in text
    assert "steering right:" in text
    assert "; and 2 more. They explain" in text


def test_what_has_no_words_is_said_by_its_name_and_numbers() -> None:
    strange = replace(
        STICKS, name="coupled_friction", where="axis_2", parameters={"size": Quantity(2.0, "Nm", "", 0.1)}
    )
    assert headline(answer(Verdict.EFFECT, [strange])).startswith("Axis 2: coupled friction, size 2.00 ± 0.10 Nm.")


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_reads_in_words_with_its_size(name: str) -> None:
    kind = EFFECTS[name]
    fields = {field for _, field, _, _ in string.Formatter().parse(kind.words) if field}
    assert kind.size.name in fields
    assert fields <= {parameter.name for parameter in kind.parameters}


@pytest.mark.parametrize("where", [*CHASSIS, *DRIVES, *ENCODERS, *STEERING, *WHEEL_PLACES, *GROUPS])
def test_every_place_reads_in_words(where: str) -> None:
    assert "_" not in place_words(where)


def test_a_recorded_axis_that_is_alike_is_not_said_to_be_unrecorded() -> None:
    """Both stand among the alternatives; what is not recorded the law itself says."""
    curve = np.column_stack([np.linspace(0.0, 9.0, 5), np.linspace(-1.0, 2.0, 5), np.full(5, 0.1)])
    law = LawAnswer("time", "", "", "dynamic", None, "s", "N", curve, None, None, None)
    alike = (Alternative(None, "other_axis", "axis_1"),)
    recorded = NamedEffect("law", "axis_1", {}, 0.97, ("law",), 0.9, alike, law)
    unrecorded = replace(recorded, law=replace(law, unrecorded="other_axis"))
    assert "not recorded" not in effect_words(recorded)
    assert "what else moves" not in next_text(answer(Verdict.LAW, [recorded]))
    assert effect_words(unrecorded).endswith(", or on another axis that is not recorded")
    assert "what else moves" in next_text(answer(Verdict.LAW, [unrecorded]))
