"""The solver: as accurate as asked for, at any step length, and honest where it fails."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import integrate

from fmu.table import neutral_effects
from fmu.variables import Block, Inputs

Array = NDArray[np.float64]

OK, DISCARD, ERROR = 0, 1, 2


@pytest.fixture(scope="module")
def prototype(core_of: Callable[..., Any]) -> Any:
    return core_of("prototype")


@pytest.fixture(scope="module")
def speed_controlled(core_of: Callable[..., Any]) -> Any:
    return core_of("prototype", neutral_effects(), Inputs.SPEED)


def reference(instance: Any, duration: float) -> Array:
    """State after `duration` with the inputs as they go, by SciPy's Radau at a tolerance of 1e-10."""
    probe = instance.copy()
    u, ramps = instance.u.copy(), instance.input_rates.copy()

    def rates(time: float, x: Array) -> Array:
        probe.x[:], probe.u[:] = x, u + time * ramps
        return probe.derivatives()

    solution = integrate.solve_ivp(rates, (0.0, duration), instance.x.copy(), "Radau", rtol=1e-10, atol=1e-12)
    assert solution.success
    return np.asarray(solution.y[:, -1])


@pytest.mark.parametrize("interval", [pytest.param(0.0005, marks=pytest.mark.slow), 0.002, 0.02])
def test_the_motion_is_that_of_a_tight_reference_in_every_posture(core: Any, posture: Array, interval: float) -> None:
    instance = core.new(alpha_l=posture[0], alpha_r=posture[1])
    truth = instance.copy()
    for step in range(round(0.06 / interval)):
        torques = np.array([1.0, 0.9, 1.1, -1.2]) * np.cos(3 * step * interval)
        for each in (instance, truth):
            each.u[:4] = torques
        instance.step(interval)
        truth.x[:] = reference(truth, interval)
    rows = core.table.block(Block.STATE)
    for row, value, expected in zip(rows, instance.x, truth.x, strict=True):
        if row.causality.value == "output":
            least = 1e-2 if row.name.startswith("alpha") else 0.1 * row.nominal
            assert value == pytest.approx(expected, abs=1e-3 * max(abs(expected), least)), row.name


def test_a_tighter_tolerance_gives_a_smaller_error(prototype: Any) -> None:
    start = prototype.new(alpha_l=0.3, alpha_r=0.2, torque_fl=1.5, torque_rl=1.2, torque_fr=1.4, torque_rr=1.0)
    expected = reference(start, 0.5)
    errors = []
    for tolerance in (1e-3, 1e-5, 1e-7):
        instance = start.copy()
        instance.raw.tolerance = tolerance
        instance.step(0.5)
        errors.append(np.abs(instance.x[:9] - expected[:9]).max())
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 1e-6


def test_a_long_step_is_the_sum_of_short_ones(core: Any) -> None:
    whole = core.new(torque_fl=0.8, torque_rl=0.8, torque_fr=0.8, torque_rr=0.8)
    parts = whole.copy()
    whole.step(10.0)
    for _ in range(1000):
        parts.step(0.01)
    assert whole["pose_x"] == pytest.approx(parts["pose_x"], rel=1e-4)
    assert whole["x_dot"] == pytest.approx(parts["x_dot"], rel=1e-4)


def test_the_shortest_step_moves_by_its_length(prototype: Any) -> None:
    instance = prototype.new(x_dot=0.5, **{f"beta_{wheel}_dot": 5.0 for wheel in ("fl", "rl", "fr", "rr")})
    for _ in range(100):
        instance.step(1e-9)
    assert instance["pose_x"] == pytest.approx(0.5e-7, rel=1e-6)


def test_advance_takes_one_internal_step_within_the_length_given(prototype: Any) -> None:
    instance = prototype.new(torque_fl=1.0, torque_rl=-1.0)
    whole, time, lengths = instance.copy(), 0.0, []
    while time < 0.05:
        lengths.append(instance.advance(0.05 - time))
        assert 0.0 < lengths[-1] <= 0.05 - time
        time += lengths[-1]
    whole.step(0.05)
    assert len(lengths) > 1
    np.testing.assert_array_equal(instance.x, whole.x)


def test_an_instance_copied_in_the_middle_goes_on_bit_for_bit(speed_controlled: Any) -> None:
    instance = speed_controlled.new(speed_fl=3.0, speed_rl=1.0, speed_fr=2.0, speed_rr=2.5)
    for _ in range(50):
        instance.step(0.002)
    twin = instance.copy()
    for each in (instance, twin):
        each.set(speed_fl=-1.0)
        for _ in range(50):
            each.step(0.002)
    assert instance.bytes() == twin.bytes()


def test_a_vehicle_at_rest_keeps_no_tiny_numbers(prototype: Any) -> None:
    instance = prototype.new(x_dot=0.1, gamma_dot=0.05)
    for _ in range(2000):
        instance.step(0.01)
    assert np.all((instance.x == 0.0) | (np.abs(instance.x) > 1e-30))


def test_speed_loops_bring_the_wheels_to_the_speed_commanded(speed_controlled: Any) -> None:
    instance = speed_controlled.new(**{f"speed_{wheel}": 4.0 for wheel in ("fl", "rl", "fr", "rr")})
    largest = 0.0
    for _ in range(5000):
        instance.step(0.002)
        largest = max(largest, abs(instance["drive_torque_fl"]))
    assert instance["beta_rr_dot"] == pytest.approx(4.0, rel=1e-3)
    assert instance["x_dot"] == pytest.approx(4.0 * speed_controlled.vehicle.geometry.wheel_radius, rel=1e-3)
    assert largest <= speed_controlled.vehicle.limits.peak_torque


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("block", [Block.STATE, Block.INPUT, Block.PARAMETER])
def test_what_is_not_finite_is_refused_by_name_and_nothing_moves(prototype: Any, block: Block, value: float) -> None:
    for row in prototype.table.block(block):
        instance = prototype.new()
        instance.blocks[block][row.index] = value
        before = instance.bytes()
        with pytest.raises(Exception, match=rf"\b{row.name}\b is not finite") as caught:
            instance.step(0.002)
        assert caught.value.status == ERROR
        assert instance.bytes()[:-200] == before[:-200]


def test_what_cannot_be_is_refused_by_name(prototype: Any) -> None:
    for row in prototype.table.block(Block.PARAMETER):
        if row.minimum is not None:
            instance = prototype.new()
            instance.set_parameter(row.name, -1.0 if not row.positive else 0.0)
            with pytest.raises(Exception, match=row.name):
                instance.derivatives()


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf])
def test_a_step_has_a_length(prototype: Any, length: float) -> None:
    with pytest.raises(Exception, match="step"):
        prototype.new().step(length)


def test_a_step_that_cannot_be_taken_is_discarded_and_says_why(prototype: Any) -> None:
    instance = prototype.new(torque_fl=1e30)
    before = instance.x.copy()
    with pytest.raises(Exception, match=r"However short the step, state \w+ is not accurate") as caught:
        instance.step(1.0)
    assert caught.value.status == DISCARD
    np.testing.assert_array_equal(instance.x, before)


numbers = st.one_of(st.floats(-5, 5), st.floats(-1e30, 1e30), st.sampled_from([0.0, np.nan, np.inf, 1e-300]))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), length=st.floats(-9, 0).map(lambda exponent: 10.0**exponent))
def test_whatever_it_is_given_it_answers_with_finite_numbers_or_with_an_error(
    speed_controlled: Any, data: st.DataObject, length: float
) -> None:
    instance = speed_controlled.new()
    for block in (Block.STATE, Block.INPUT, Block.PARAMETER):
        row = data.draw(st.sampled_from(speed_controlled.table.block(block)))
        instance.blocks[block][row.index] = data.draw(numbers)
    outcome = instance.attempt(length)
    if outcome.status == OK:
        values = [instance.blocks[block] for block in (Block.STATE, Block.OUTPUT)]
        assert np.isfinite(np.concatenate(values)).all()
    else:
        names = [row.name for row in speed_controlled.table.variables]
        assert any(name in outcome.message for name in [*names, "step"])


@pytest.mark.parametrize("ramp", [0.0, 3.0])
def test_halving_the_step_divides_the_error_by_eight(prototype: Any, ramp: float) -> None:
    """Order three, inputs held or ramped, on a vehicle soft enough for it to show; all steps are alike."""
    soft = {"creep_stiffness": 5e2, "epsilon": 50.0, "stick_time": 100.0}
    start = prototype.new(alpha_l=0.3, alpha_r=0.2, torque_fl=1.5, torque_rl=1.2, torque_fr=1.4, torque_rr=1.0, **soft)
    start.input_rates[:4] = ramp * np.array([1.0, -0.5, 0.7, 1.2])
    expected, errors = reference(start, 0.32), []
    for length in (0.0025, 0.00125, 0.000625):
        instance = start.copy()
        instance.raw.tolerance, instance.raw.step_length = 1e9, 1.0
        for _ in range(round(0.32 / length)):
            instance.step(length)
        errors.append(np.abs(instance.x[:9] - expected[:9]).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.1)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(3.0, abs=0.1)
