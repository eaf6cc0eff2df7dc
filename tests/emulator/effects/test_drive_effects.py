"""Drives that do not give what they report, gears and couplings that give way, encoders that err."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from emulator.effects import inject
from emulator.effects.transmissions import MOTOR_SHARE, SpringWithPlay
from emulator.prototype import load_prototype
from ident.effects import make_effect
from ident.errors import UserError

Make = Callable[..., object]
STEP = 1e-3


def reported(moving: object, rate: float, wheel: int) -> float:
    return float(moving.hold_speed([rate] * 4, 3.0)[wheel])


@pytest.mark.parametrize("rate", [3.0, -3.0])
def test_a_drive_with_a_gain_error_reports_less_or_more_than_acts(make: Make, rate: float) -> None:
    moving = make("torque_gain@drive_fr=8%", lifted=True)
    p = moving.prototype.truth
    load = p["d_vw"] * rate + math.copysign(p["d_cw"], rate)
    assert reported(moving, rate, 2) == pytest.approx(load / 1.08, rel=1e-3)


@pytest.mark.parametrize("rate", [3.0, -3.0])
def test_a_biased_drive_reports_all_but_its_bias(make: Make, rate: float) -> None:
    moving = make("torque_bias@drive_rl=0.06Nm", lifted=True)
    p, gear = moving.prototype.truth, moving.prototype.geometry.gear_ratio
    load = p["d_vw"] * rate + math.copysign(p["d_cw"], rate)
    assert reported(moving, rate, 1) == pytest.approx(load - gear * 0.06, rel=1e-3)


def test_a_drive_that_follows_speeds_its_wheel_up_behind_a_filter_of_first_order(make: Make) -> None:
    """In the air, with a = B_w/d_v: 1 - exp(-t/a) without, 1 - (a exp(-t/a) - T exp(-t/T))/(a - T) with the filter."""
    time, duration, gained = 0.05, 0.1, []
    for text in ((), (f"torque_filter@drive_rl={time}s",)):
        moving = make(*text, lifted=True)
        p = moving.prototype.truth
        moving.torque([p["d_cw"] + 1.0] * 4, 2.0)
        start = moving.vehicle.ground_truth().wheel_rates[1]
        moving.torque([p["d_cw"] + 7.0] * 4, duration)
        gained.append(moving.vehicle.ground_truth().wheel_rates[1] - start)
    a = p["B_w"] / p["d_vw"]
    plain = 1 - math.exp(-duration / a)
    behind = 1 - (a * math.exp(-duration / a) - time * math.exp(-duration / time)) / (a - time)
    assert gained[1] / gained[0] == pytest.approx(behind / plain, abs=0.01)


def test_what_acts_before_its_cause_is_refused() -> None:
    with pytest.raises(UserError, match="before its cause"):
        inject(load_prototype(), [make_effect("torque_filter", "drive_fl", {"time": -0.01})], STEP)


def test_a_drive_without_power_has_no_bias(make: Make) -> None:
    moving = make("torque_bias@drive_fl=0.5Nm", lifted=True)
    moving.vehicle.drives[0].disable()
    moving.vehicle.advance(0.5)
    assert abs(moving.vehicle.ground_truth().wheel_angles[0]) < 1e-6


def test_ripple_has_its_order_per_motor_turn_and_its_phase(make: Make) -> None:
    """At nearly constant speed B_w b'' = A i_G sin(n i_G b + phase) + what the smooth torque does not cancel."""
    amplitude, order, phase = 0.05, 3.0, 0.9
    moving = make(f"torque_ripple@drive_fl={amplitude}Nm,order={order},phase={phase}rad", lifted=True)
    p, gear = moving.prototype.truth, moving.prototype.geometry.gear_ratio
    moving.torque([p["d_cw"] + p["d_vw"] * 2.0] * 4, 1.0)
    angles, rates = [], []
    for _ in range(1500):
        moving.torque([p["d_cw"] + p["d_vw"] * 2.0] * 4, STEP)
        truth = moving.vehicle.ground_truth()
        angles.append(truth.wheel_angles[0])
        rates.append(truth.wheel_rates[0])
    beta, rate = np.array(angles), np.array(rates)
    middle = (beta[1:-2] + beta[2:-1]) / 2
    acceleration = np.diff(rate)[1:-1] / STEP
    wave = order * gear * beta[1:-2]
    columns = np.stack([np.sin(wave), np.cos(wave), np.ones_like(wave), rate[1:-2]], axis=1)
    sine, cosine, *_ = np.linalg.lstsq(columns, p["B_w"] * acceleration, rcond=None)[0]
    assert len(middle) == len(acceleration)
    assert math.hypot(sine, cosine) == pytest.approx(gear * amplitude, rel=0.01)
    assert math.atan2(cosine, sine) == pytest.approx(phase, abs=0.05)


@pytest.mark.parametrize("delay", [4e-3, 6.5e-3])
def test_a_late_drive_moves_as_a_prompt_one_did_before(make: Make, delay: float) -> None:
    late, prompt = make(f"time_delay@drive_rr={delay}s", lifted=True), make(lifted=True)
    late.torque([15.0] * 4, 0.3)
    before, rest = 0.3 - math.ceil(delay / STEP) * STEP, math.ceil(delay / STEP) - delay / STEP
    prompt.torque([15.0] * 4, before)
    first = prompt.vehicle.ground_truth().wheel_angles[3]
    prompt.vehicle.advance(STEP)
    second = prompt.vehicle.ground_truth().wheel_angles[3]
    prompt.vehicle.advance(0.3 - before - STEP)
    # Exact in a linear system; half a step of delay also smears the instant of breaking away.
    assert late.vehicle.ground_truth().wheel_angles[3] == pytest.approx((1 - rest) * first + rest * second, rel=1e-3)
    assert late.vehicle.ground_truth().wheel_angles[0] == prompt.vehicle.ground_truth().wheel_angles[0]
    assert late.reported() == pytest.approx(prompt.reported(), rel=1e-6)


@pytest.mark.parametrize(("side", "drive_signs"), [("left", (-1, 1, 0, 0)), ("right", (0, 0, 1, -1))])
def test_a_late_encoder_reports_what_was(make: Make, side: str, drive_signs: tuple[int, ...]) -> None:
    moving = make(f"time_delay@encoder_{side}=7ms")
    index, scale = ("left", "right").index(side), 131072 / (2 * math.pi)
    seen, was = [], []
    for _ in range(400):
        moving.torque([12.0 * sign for sign in drive_signs], STEP)
        seen.append((moving.vehicle.encoders[index].position() - 65536) / scale)
        was.append(moving.vehicle.ground_truth().steering_angles[index])
    assert abs(was[-1]) > 0.05
    assert np.array(seen[7:]) == pytest.approx(np.array(was[:-7]), abs=1.1 / scale)


def test_an_encoder_with_a_zero_error_adds_it(make: Make) -> None:
    moving = make("steering_offset@steering_right=0.5deg")
    counts = moving.vehicle.encoders[1].position() - 65536
    assert counts == round(math.radians(0.5) * 131072 / (2 * math.pi))
    assert moving.vehicle.encoders[0].position() == 65536


def strike(moving: object, duration: float) -> NDArray[np.float64]:
    """Twist of the gear of wheel fl after a torque has been let go (n,) [rad]: motor encoder minus wheel."""
    moving.torque([14.0, 0.0, 0.0, 0.0], 0.2)
    twist = []
    for _ in range(round(duration / STEP)):
        moving.torque([0.0] * 4, STEP)
        twist.append(moving.motor_angles()[0] - moving.vehicle.ground_truth().wheel_angles[0])
    return np.array(twist)


def test_two_inertias_on_a_compliant_gear_ring_at_their_resonance(make: Make) -> None:
    """Free-free: w^2 = k (1/J_1 + 1/J_2), counted from the spectrum of the twist."""
    compliance = 1e-3
    moving = make(f"elasticity@drive_fl={compliance}", lifted=True)
    twist = strike(moving, 0.25)
    inertia = moving.prototype.truth["B_w"]
    motor, wheel = MOTOR_SHARE * inertia, (1 - MOTOR_SHARE) * inertia
    expected = math.sqrt((1 / motor + 1 / wheel) / compliance)
    frequencies, power = signal.periodogram(twist - twist.mean(), 1 / STEP, window="hann", nfft=1 << 14)
    assert 2 * math.pi * frequencies[np.argmax(power)] == pytest.approx(expected, rel=0.03)


def test_a_compliant_gear_twists_in_proportion_to_what_it_transmits(make: Make) -> None:
    moving = make("elasticity@drive_fl=0.002", lifted=True)
    moving.vehicle.lower()
    moving.torque([3.0, 0.0, 0.0, 0.0], 3.0)
    twist = moving.motor_angles()[0] - moving.vehicle.ground_truth().wheel_angles[0]
    assert twist == pytest.approx(0.002 * 3.0, rel=0.01)


def test_a_gear_with_play_lets_the_motor_turn_before_the_wheel_follows(make: Make) -> None:
    gap = 0.02
    moving = make(f"backlash@drive_fl={gap}rad")
    moving.torque([1.0, 0.0, 0.0, 0.0], 1.5)
    forward = moving.motor_angles()[0]
    moving.torque([-1.0, 0.0, 0.0, 0.0], 1.5)
    backward = moving.motor_angles()[0]
    # The motor strikes the wheel at the end of its play; friction stops it at once.
    assert abs(moving.vehicle.ground_truth().wheel_angles[0]) < gap / 50
    assert forward - backward == pytest.approx(gap, rel=0.02)


def test_a_flexible_gear_keeps_the_inertia_of_the_drive(make: Make) -> None:
    flexible, rigid = make("elasticity@drive_fl=0.0003", lifted=True), make(lifted=True)
    for moving in (flexible, rigid):
        moving.torque([12.0, 0.0, 0.0, 0.0], 0.6)
    rates = [moving.vehicle.ground_truth().wheel_rates[0] for moving in (flexible, rigid)]
    assert rates[0] == pytest.approx(rates[1], rel=2e-3)


def test_a_soft_coupling_lets_both_units_of_a_side_turn_the_same_way(make: Make) -> None:
    """Pulling straight with F a wheel, the lever a turns front and rear alike; friction holds the rest."""
    compliance, torque = 5e-5, 30.0
    moving = make(f"elasticity@steering_left={compliance}")
    for share in np.linspace(0.0, 1.0, 200):
        moving.torque([share * torque] * 4, STEP)
    truth, p, g = moving.vehicle.ground_truth(), moving.prototype.truth, moving.prototype.geometry
    rate = truth.wheel_rates[0]
    acceleration = 4 * (torque - p["d_cw"] - p["d_vw"] * rate) / g.wheel_radius
    acceleration /= p["m_ch"] + 4 * p["B_w"] / g.wheel_radius**2
    moment = p["m_ch"] / 4 * acceleration * g.wheel_offset
    carried = abs(truth.coupling_error[0]) / compliance
    assert 0.98 * moment - p["d_cl"] / 2 <= carried <= moment
    assert abs(truth.coupling_error[1]) < carried * compliance / 10


@pytest.mark.parametrize("text", ["elasticity@drive_fl=1e-6", "elasticity@steering_left=1e-7"])
def test_a_spring_too_stiff_for_the_step_is_refused(make: Make, text: str) -> None:
    with pytest.raises(UserError, match="stiffer than a step"):
        make(text)


def test_a_spring_with_play_pushes_and_never_pulls() -> None:
    spring = SpringWithPlay(stiffness=100.0, damping=5.0, gap=0.2)
    assert spring.torque(0.05, 3.0) == 0.0
    assert spring.torque(0.2, 0.0) == pytest.approx(10.0)
    assert spring.torque(-0.2, 0.0) == pytest.approx(-10.0)
    assert spring.torque(0.11, -3.0) == 0.0
