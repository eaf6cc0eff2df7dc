"""Effects and inputs of the FMU change its motion as their definitions say."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from emulator.effects.measured import Table
from fmu.table import neutral_effects, variable_table
from fmu.variables import Block
from ident.effects import LAWS, make_effect
from ident.effects.laws import COUNT, coefficient
from ident.vehicle.description import load_vehicle

GRAVITY = 9.80665
ROLLING = {"x_dot": 0.5, **{f"beta_{wheel}_dot": 5.0 for wheel in ("fl", "rl", "fr", "rr")}}


@pytest.fixture(scope="module")
def plain(core_of: Callable[..., Any]) -> Any:
    return core_of("prototype")


@pytest.fixture(scope="module")
def extended(core_of: Callable[..., Any]) -> Any:
    return core_of("prototype", neutral_effects())


WAVE = tuple(float(1.5 + np.sin(1.3 * index)) for index in range(COUNT))
AROUND = 0.1 * COUNT


@pytest.fixture(scope="module")
def lawful(core_of: Callable[..., Any]) -> Any:
    """With every law without a name at one wheel, of size zero; what is over an angle comes around."""
    numbers = {"scale": 0.0, "start": -1.1, "step": 0.1} | {coefficient(index): one for index, one in enumerate(WAVE)}
    return core_of(
        "prototype",
        [make_effect(name, "wheel_rl", numbers | {"period": AROUND * ("angle" in name)}) for name in LAWS],
    )


def rates_of(instance: Any) -> dict[str, float]:
    names = [row.name for row in instance.core.table.block(Block.STATE)]
    return dict(zip(names, instance.derivatives(), strict=True))


def change(extended: Any, parameter: str, value: float, **state: float) -> dict[str, float]:
    """What a parameter of an effect adds to the derivatives."""
    before = extended.new(**state)
    after = before.copy()
    after.set_parameter(parameter, value)
    first, second = rates_of(before), rates_of(after)
    return {name: second[name] - first[name] for name in first}


def test_effects_of_no_size_change_nothing(plain: Any, extended: Any) -> None:
    generator = np.random.default_rng(1)
    for _ in range(20):
        first, second = plain.new(), extended.new()
        state = generator.normal(size=first.x.size) * 0.1
        for instance in (first, second):
            instance.x[:] = state
            instance.u[:] = [*generator.normal(size=4), 0.0, 0.0, 0.0]
        second.u[:] = first.u
        np.testing.assert_allclose(second.derivatives(), first.derivatives(), rtol=1e-9, atol=1e-9)


def test_a_stribeck_hump_holds_what_coulomb_friction_would_let_go(extended: Any) -> None:
    geometry = extended.vehicle.geometry
    instance = extended.new()
    friction = instance["d_cl"] + 2 * geometry.lever_ratio * instance["d_cw"]
    torque = (friction + 3.0) / (2 * geometry.gear_ratio * geometry.lever_ratio)
    instance.set(torque_fl=-torque, torque_rl=torque)
    humped = instance.copy()
    humped.set_parameter("stribeck.steering_left.amplitude", 6.0)
    for each in (instance, humped):
        for _ in range(500):
            each.step(0.002)
    assert instance["alpha_l"] > 0.1
    assert abs(humped["alpha_l"]) < 3e-3


@pytest.mark.parametrize("angle", [-3.0, -0.2, 0.3, 9.1])
@pytest.mark.parametrize("rate", [-0.4, 2.0])
@pytest.mark.parametrize(
    ("name", "over", "times"), [("rate", "rate", 1.0), ("angle", "angle", 1.0), ("angle_rate", "angle", None)]
)
def test_a_law_is_the_curve_of_its_table(
    lawful: Any, name: str, over: str, times: float | None, angle: float, rate: float
) -> None:
    added = change(lawful, f"law_{name}.wheel_rl.scale", 0.7, beta_rl=angle, beta_rl_dot=rate)
    curve = Table(-1.1, 0.1, 0.0 if over == "rate" else AROUND, WAVE)
    torque = 0.7 * curve(rate if over == "rate" else angle) * (rate if times is None else times)
    assert added["beta_rl_dot"] == pytest.approx(-torque / lawful.vehicle.prior["B_w"], rel=1e-9)


def test_a_slope_by_input_is_the_slope_by_effect(extended: Any) -> None:
    by_input = extended.new(gamma=0.7, slope_y=0.05)
    by_effect = extended.new(gamma=0.7)
    by_effect.set_parameter("slope.chassis.angle", 0.05)
    by_effect.set_parameter("slope.chassis.direction", np.pi / 2)
    np.testing.assert_allclose(by_input.derivatives(), by_effect.derivatives(), rtol=1e-12, atol=1e-12)
    expected = -GRAVITY * np.sin(0.05) * np.array([np.sin(0.7), np.cos(0.7)])
    rates = rates_of(by_input)
    np.testing.assert_allclose([rates["x_dot"], rates["y_dot"]], expected, rtol=1e-12)


def test_payload_adds_to_the_mass_and_to_what_the_wheels_can_hold(plain: Any) -> None:
    light = plain.new(**{**ROLLING, "x_dot": 2.0})
    heavy = light.copy()
    heavy.set(payload=400.0)
    slides = [rates_of(instance)["x_dot"] for instance in (light, heavy)]
    assert slides[0] == pytest.approx(-plain.vehicle.limits.floor_friction * GRAVITY, rel=1e-3)
    assert slides[1] == pytest.approx(slides[0], rel=1e-3)
    gentle = [plain.new(x_dot=1e-6), plain.new(x_dot=1e-6, payload=400.0)]
    ratio = rates_of(gentle[0])["x_dot"] / rates_of(gentle[1])["x_dot"]
    assert ratio == pytest.approx(1 + 400.0 / plain.vehicle.prior["m_ch"], rel=1e-3)


def test_a_payload_presses_on_all_wheels_alike_wherever_the_centre_of_mass_is(extended: Any) -> None:
    """Wheels that slide sideways brake by what rests on them, the vehicle's weight at its centre of mass."""
    ahead, prior = 0.2, extended.vehicle.prior

    def turning(load: float) -> float:
        """Torque about the centre of the chassis, of contacts that all slide sideways at once."""
        instance = extended.new(y_dot=5.0, payload=load)
        instance.set_parameter("com_offset.chassis.x", ahead)
        rates = rates_of(instance)
        inertia = sum(prior[name] for name in ("C_ch", "C_l", "C_r")) + prior["m_ch"] * ahead**2
        return inertia * rates["gamma_dot"] + prior["m_ch"] * ahead * rates["y_dot"]

    expected = -extended.vehicle.limits.floor_friction * prior["m_ch"] * GRAVITY * ahead
    assert turning(0.0) == pytest.approx(expected, rel=1e-2)
    assert turning(300.0) == pytest.approx(expected, rel=1e-2)


def test_a_larger_wheel_rolls_further(extended: Any) -> None:
    instance = extended.new(**ROLLING)
    instance.set_parameter("wheel_radius.wheel_fl.error", 0.01)
    instance.outputs()
    assert instance["slip_long_fl"] == pytest.approx(0.5 - 0.11 * 5.0)
    assert instance["slip_long_rr"] == pytest.approx(0.0, abs=1e-12)


def test_a_drive_with_a_gain_error_gives_that_much_more_torque(extended: Any) -> None:
    added = change(extended, "torque_gain.drive_rl.error", 0.1, torque_rl=2.0)
    expected = extended.vehicle.geometry.gear_ratio * 0.2 / extended.vehicle.prior["B_w"]
    assert added["beta_rl_dot"] == pytest.approx(expected, rel=1e-12)
    assert added["beta_fl_dot"] == 0.0


def test_an_encoder_with_a_zero_error_reports_it(extended: Any) -> None:
    instance = extended.new(alpha_l=0.2, alpha_r=0.1)
    instance.set_parameter("steering_offset.steering_left.offset", 0.004)
    instance.outputs()
    assert instance["alpha_l_reported"] == pytest.approx(0.204)
    assert instance["alpha_r_reported"] == pytest.approx(0.1)
    assert set(change(extended, "steering_offset.steering_left.offset", 0.004, alpha_l=0.2).values()) == {0.0}


def test_an_eccentric_mass_turns_the_vehicle_when_it_is_pushed(extended: Any) -> None:
    """Newton and Euler about the true centre of mass: the push passes beside it."""
    prior = extended.vehicle.prior
    instance = extended.new(slope_x=0.1)
    instance.set_parameter("com_offset.chassis.y", 0.05)
    rates = rates_of(instance)
    assert rates["gamma_dot"] == pytest.approx(0.0, abs=1e-12)
    assert rates["x_dot"] == pytest.approx(-GRAVITY * np.sin(0.1), rel=1e-12)
    pushed = extended.new(x_dot=1e-6)
    pushed.set_parameter("com_offset.chassis.y", 0.05)
    force = -4 * pushed["creep_stiffness"] * 1e-6
    inertia = sum(prior[name] for name in ("C_ch", "C_l", "C_r"))
    turning = rates_of(pushed)["gamma_dot"]
    assert turning == pytest.approx(0.05 * force / inertia, rel=1e-3)


def test_low_friction_of_one_wheel_is_where_its_limit_starts() -> None:
    vehicle = load_vehicle()
    effects = [make_effect("slip", "wheel_fr", {"friction": 0.2})]
    table = variable_table(vehicle, vehicle.prior, effects)
    starts = [table[f"friction_limit_{wheel}"].start for wheel in ("fl", "rl", "fr", "rr")]
    usual = vehicle.limits.floor_friction
    assert starts == [usual, usual, 0.2, usual]
