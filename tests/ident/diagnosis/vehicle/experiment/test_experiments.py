"""What was driven decides what can be seen, and what is advised next; a load counts by what it weighs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ident.campaign.steps import DIAGNOSTIC as STEPS
from ident.diagnosis.names import EffectName
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.diagnosis.vehicle.experiment.advice import Driven, driven_steps, hidden_effects, next_experiment
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC, FOUR, ideal_record
from ident.diagnosis.vehicle.experiment.visibility import Visibility
from ident.effects import make_effect
from ident.records.record import PAYLOAD, Record, Segment
from ident.vehicle.description import VehicleDescription, load_vehicle

Drives = Callable[..., tuple[Record, Record]]

VISIBILITY = Visibility(load_vehicle())
FOUR_STEPS = dict.fromkeys((drive.name for drive in FOUR), (0.0,))


def loaded(segment: Segment, name: str, mass: float) -> Segment:
    return replace(segment, step=name, extra={PAYLOAD: np.full(len(segment), mass)})


@pytest.mark.parametrize(
    ("suffix", "loads", "seen"),
    [
        ("_loaded", (0.1,), True),
        ("", (0.0, 0.1), True),
        ("_loaded", (0.0,), False),
        ("", (0.0, 0.04), False),
        ("", (0.1,), False),
        ("", (0.1, 0.2), True),
    ],
)
def test_a_known_load_shows_the_gain_of_drives_beside_the_same_motion_with_another(
    suffix: str, loads: tuple[float, ...], seen: bool
) -> None:
    """By its mass, whatever its step is called; where the load never changes all parameters may be larger instead."""
    driven = Driven(FOUR_STEPS | {f"straight{suffix}": loads, f"rotation{suffix}": loads})
    assert (EffectName.TORQUE_GAIN not in hidden_effects(driven, VISIBILITY)) is seen


def test_loads_of_a_step_are_those_of_all_records(prototype: VehicleDescription) -> None:
    mass = prototype.prior["m_ch"]
    straight = next(segment for segment in ideal_record(FOUR, prototype).segments if segment.step == "straight")
    records = [Record([loaded(straight, "straight", weight * mass)], "one") for weight in (0.1, 0.2, 0.0)]
    assert sorted(driven_steps(records, mass).loads["straight"]) == pytest.approx([0.0, 0.1, 0.2])


def test_steps_without_a_load_are_known_by_name() -> None:
    assert EffectName.TORQUE_GAIN not in hidden_effects(Driven(FOUR_STEPS | {"straight_dither": (0.0,)}), VISIBILITY)
    assert EffectName.TORQUE_GAIN in hidden_effects(Driven(FOUR_STEPS | {"straight_slow": (0.0,)}), VISIBILITY)


@pytest.mark.parametrize(("angle", "seen"), [(0.0175, True), (0.005, False), (None, False)])
def test_a_slope_must_be_steep_and_known_to_show_the_centre_of_mass(angle: float | None, seen: bool) -> None:
    given = () if angle is None else (make_effect(EffectName.SLOPE, "chassis", {"angle": angle}),)
    assert (EffectName.COM_OFFSET not in hidden_effects(Driven(FOUR_STEPS, given), VISIBILITY)) is seen


def test_a_diagnostic_campaign_drives_every_experiment_that_needs_no_other_floor() -> None:
    for experiment in DIAGNOSTIC.values():
        assert {drive.name for drive in experiment.drives} <= set(STEPS)


def test_what_is_advised_is_not_driven_yet(prototype: VehicleDescription, drives: Drives) -> None:
    fit, confirm = drives(prototype, lambda segment: segment)
    findings = replace(diagnose_vehicle([fit], [confirm], prototype).findings, invisible=("torque_gain",))
    asked = next_experiment(findings, Driven(FOUR_STEPS), VISIBILITY)
    assert asked is not None
    # In the air four motors do the same without a floor: it tells more of a gain than motors against each other.
    assert "wheel_lifted" in asked
    assert "torque_gain" in asked
    done = FOUR_STEPS | {"wheel_lifted": (0.0,), "straight_loaded": (0.1,), "rotation_loaded": (0.1,)}
    assert "torque dither" in str(next_experiment(findings, Driven(done), VISIBILITY))
    slope = make_effect(EffectName.SLOPE, "chassis", {"angle": 0.0175})
    done |= {"straight_dither": (0.0,)}
    assert next_experiment(findings, Driven(done, (slope,)), VISIBILITY) is None
