"""Wheels that slide are found where their traction points; couplings that give way are held by dry friction."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.experiment.ideal import Drive, ideal_record
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.sliding import (
    SLIDING,
    adhesion,
    slides_alone,
    sliding_cause,
    sliding_times,
    traction,
)
from ident.diagnosis.vehicle.records.sources import Source, sources_of
from ident.diagnosis.vehicle.records.transforms import Setting, transform_cause
from ident.estimate.filters import Processing, differentiate, zero_phase
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

AHEAD = 0.02
"""Part of its speed by which the sliding wheel runs ahead at most."""

GRIP = 0.6
"""Part of its largest traction up to which it holds."""


@pytest.fixture(scope="module")
def straight(prototype: VehicleDescription) -> Source:
    record = ideal_record([Drive(Step.STRAIGHT)], prototype)
    sources = sources_of(record, prototype.geometry, [Step.STRAIGHT], Processing())
    return next(source for source in sources if source.channel is Channel.KINEMATIC)


@pytest.fixture(scope="module")
def setting(prototype: VehicleDescription, straight: Source) -> Setting:
    return Setting(prototype.geometry, prototype.prior.values, straight.sample_time)


def sliding(straight: Source, setting: Setting, wheels: list[int], sense: float = 1.0) -> tuple[Array, Array]:
    """Signals of a straight drive in which some wheels run ahead the way they pull, and their speeds [m/s]."""
    inputs = straight.inputs.copy()
    pull = traction(inputs, 0, setting)
    rolling = setting.geometry.wheel_radius * inputs[:, SLICES["beta_rate"].start]
    beyond = np.maximum(np.abs(pull) / np.abs(pull).max() - GRIP, 0.0) / (1 - GRIP)
    ahead = sense * AHEAD * np.abs(rolling) * beyond * np.sign(pull)
    for wheel in wheels:
        more = ahead / setting.geometry.wheel_radius
        inputs[:, SLICES["beta_rate"].start + wheel] += more
        inputs[:, SLICES["beta_acceleration"].start + wheel] += differentiate(more, setting.sample_time)
        spin = setting["B_w"] * differentiate(more, setting.sample_time) + setting["d_vw"] * more
        inputs[:, SLICES["torques"].start + wheel] += spin / setting.geometry.gear_ratio
    return inputs, ahead


def test_a_known_load_presses_on_the_wheels(straight: Source, setting: Setting) -> None:
    loaded = straight.inputs.copy()
    loaded[:, SLICES["payload"]] = 80.0
    ratio = (setting["m_ch"] + 80.0) / setting["m_ch"]
    wheels = (0, 1, 2, 3)
    assert adhesion(straight.inputs, wheels, setting) == pytest.approx(ratio * adhesion(loaded, wheels, setting))


def test_nothing_slides_where_all_wheels_roll(straight: Source, setting: Setting) -> None:
    for where in ("wheel_fl", "wheel_rr", "chassis"):
        assert not np.any(sliding_cause(where).sliding(straight.inputs, setting))


def test_a_wheel_that_runs_ahead_the_way_it_pulls_slides_by_as_much(straight: Source, setting: Setting) -> None:
    inputs, ahead = sliding(straight, setting, [2])
    found = sliding_cause("wheel_fr").sliding(inputs, setting)[:, 0]
    large = np.abs(ahead) > 0.3 * np.abs(ahead).max()
    assert found[large] == pytest.approx(ahead[large], rel=0.05)


def test_what_gives_way_in_proportion_to_its_traction_slides_only_where_that_is_large(
    straight: Source, setting: Setting
) -> None:
    """By half of a per cent of its speed, as tyres do; beyond that anything that runs ahead slides."""
    inputs = straight.inputs.copy()
    pull = traction(inputs, 2, setting)
    full = np.abs(pull) / np.abs(pull).max()
    rolling = setting.geometry.wheel_radius * inputs[:, SLICES["beta_rate"].start + 2]
    ahead = 1.2 * SLIDING * np.abs(rolling) * np.sign(pull) * full
    inputs[:, SLICES["beta_rate"].start + 2] += ahead / setting.geometry.wheel_radius
    found = sliding_cause("wheel_fr").sliding(inputs, setting)[:, 0]
    assert np.all(found[full < 0.5] == 0)
    assert np.any(found[full > 0.9] != 0)


def test_the_wheels_beside_a_sliding_one_roll_and_the_floor_is_not_slippery(straight: Source, setting: Setting) -> None:
    inputs, _ = sliding(straight, setting, [2])
    for where in ("wheel_fl", "wheel_rl", "wheel_rr", "chassis"):
        assert not np.any(sliding_cause(where).sliding(inputs, setting))


def test_two_wheels_that_slide_make_a_slippery_floor(straight: Source, setting: Setting) -> None:
    inputs, ahead = sliding(straight, setting, [0, 2])
    found = sliding_cause("chassis").sliding(inputs, setting)
    large = np.abs(ahead) > 0.3 * np.abs(ahead).max()
    assert found[large][:, [0, 2]] == pytest.approx(np.stack([ahead, ahead], axis=1)[large], rel=0.05)
    assert not np.any(found[large][:, [1, 3]])


def test_a_wheel_that_runs_ahead_against_its_pull_does_not_slide(straight: Source, setting: Setting) -> None:
    inputs, _ = sliding(straight, setting, [2], sense=-1.0)
    assert not np.any(sliding_cause("wheel_fr").sliding(inputs, setting))


@pytest.mark.parametrize(("wheels", "alone"), [([2], True), ([0, 2], False)])
def test_the_floor_under_one_wheel_is_no_cause_where_others_slide(
    straight: Source, setting: Setting, wheels: list[int], alone: bool
) -> None:
    inputs, _ = sliding(straight, setting, wheels)
    times = sliding_times(straight.inputs, setting) + sliding_times(inputs, setting)
    assert slides_alone(sliding_cause("wheel_fr"), times) is alone
    assert slides_alone(sliding_cause("chassis"), times)


def test_what_slid_is_taken_off_speed_and_torque_of_the_wheel(straight: Source, setting: Setting) -> None:
    inputs, _ = sliding(straight, setting, [2])
    rolling = sliding_cause("wheel_fr").without(inputs, np.ones(1), setting)
    for name in ("beta_rate", "torques"):
        column = SLICES[name].start + 2
        left, added = (
            zero_phase(signals[:, column] - straight.inputs[:, column], Processing().cutoff, setting.sample_time)
            for signals in (rolling, inputs)
        )
        assert np.sqrt(np.mean(left**2)) < 0.1 * np.sqrt(np.mean(added**2)), name


def held(load: Array, friction: float) -> Array:
    """A massless body on a spring of stiffness one, dragged by `load`, held by dry friction: moved in small steps."""
    place, found = 0.0, []
    for force in np.repeat(load, 20):
        push = force - place
        if abs(push) > friction:
            place += push - np.sign(push) * friction
        found.append(place)
    return np.array(found)[19::20]


@pytest.mark.parametrize("name", [EffectName.ELASTICITY, EffectName.BACKLASH])
def test_a_coupling_gives_way_only_beyond_the_dry_friction_of_a_unit(
    name: EffectName, straight: Source, setting: Setting
) -> None:
    arm, friction = setting.geometry.wheel_offset, setting["d_cl"] / 2
    load = -arm * (traction(straight.inputs, 0, setting) + traction(straight.inputs, 1, setting)) / 2
    size = {EffectName.ELASTICITY: 2e-5, EffectName.BACKLASH: 1e-3}[name]
    changed = transform_cause(name, "steering_left").without(straight.inputs, np.array([size]), setting)
    twist = changed[:, SLICES["twist"].start]
    if name == EffectName.ELASTICITY:
        expected = size * held(load, friction)
        assert twist == pytest.approx(expected, abs=0.05 * np.abs(expected).max())
    else:
        beyond = np.abs(load) > 1.5 * friction
        assert np.mean(np.abs(twist[beyond] - size / 2 * np.sign(load[beyond])) < 0.05 * size) > 0.9
        first = int(np.argmax(np.abs(load) > friction))
        assert np.abs(twist[: max(first - round(0.1 / setting.sample_time), 0)]).max(initial=0.0) < 0.02 * size
