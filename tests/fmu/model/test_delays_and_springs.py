"""Delays, filters, bristles, play and compliance of the FMU against what is known of them in closed form."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.table import variable_table
from fmu.variables import Block, Inputs
from ident.effects import EFFECTS, Effect, make_effect
from ident.plant.springs import DAMPING_RATIO, MOTOR_SHARE
from ident.vehicle.description import load_vehicle

Array = NDArray[np.float64]

WITH_STATES = ("time_delay", "torque_filter", "backlash", "elasticity", "presliding")
STEP = 5e-4
STIFF = 1e6
"""Spring that gives less than what is looked at [Nm/rad]."""
FREE = {"friction_limit_fl": 1e-9, "friction_limit_rl": 1e-9, "friction_limit_fr": 1e-9, "friction_limit_rr": 1e-9}
"""The jack-stand."""
FRICTIONLESS = {"d_cw": 0.0, "d_vw": 0.0, "d_cl": 0.0, "d_vl": 0.0, "d_cr": 0.0, "d_vr": 0.0}


def effects_of(size: float) -> list[Effect]:
    """Every effect with states, at every place."""
    return [
        make_effect(name, where, {EFFECTS[name].size.name: size})
        for name in WITH_STATES
        for where in EFFECTS[name].places
    ]


@pytest.fixture(scope="module")
def soft(core_of: Callable[..., Any]) -> Any:
    """Has them all, of size zero."""
    return core_of("prototype", effects_of(0.0))


@pytest.fixture(scope="module")
def late(core_of: Callable[..., Any]) -> Any:
    """Has delays of size zero."""
    return core_of("prototype", [effect for effect in effects_of(0.0) if effect.name == "time_delay"])


def watch(instance: Any, torques: Callable[[float], dict[str, float]], duration: float, *names: str) -> Array:
    """Variables (N, n) every STEP [s], under torques by the time in the middle of each."""
    rows = []
    for count in range(round(duration / STEP)):
        instance.set(**torques((count + 0.5) * STEP))
        instance.step(STEP)
        rows.append([instance[name] for name in names])
    return np.array(rows)


def phase(signal: Array, omega: float) -> complex:
    """Fourier coefficient over whole periods, at the ends of steps."""
    time = STEP * np.arange(1, len(signal) + 1)
    return complex(np.mean((signal - signal.mean()) * np.exp(-1j * omega * time)))


def test_without_effects_no_state_is_added(soft: Any) -> None:
    vehicle = load_vehicle()
    plain = variable_table(vehicle, vehicle.prior)
    added = len(soft.table.block(Block.STATE)) - len(plain.block(Block.STATE))
    # Bristles of a wheel and of all wheels, of a side and of both, each have a state of their own.
    assert added == 2 * (4 + 2 + 4 + 2) + 4 + 2 * (4 + 2)
    names = {row.name for row in plain.variables}
    assert not any(word in name for name in names for word in ("twist", "filtered", "spring", "following", "bent"))


@pytest.mark.parametrize("inputs", list(Inputs))
def test_effects_of_size_zero_leave_the_motion_of_the_plain_model(core_of: Callable[..., Any], inputs: Inputs) -> None:
    def drive(core: Any, **parameters: float) -> Any:
        instance = core.new(**parameters)
        command = "torque" if inputs is Inputs.TORQUE else "speed"
        for count in range(500):
            swing = np.sin(2 * np.pi * count * 0.002)
            size = {"fl": 2.0 - swing, "rl": 2.0 + swing, "fr": 2.0, "rr": 2.0}
            instance.set(**{f"{command}_{wheel}": value for wheel, value in size.items()})
            instance.step(0.002)
        return instance

    plain = drive(core_of("prototype", (), inputs))
    soft = drive(core_of("prototype", effects_of(0.0), inputs), spring_stiffness=STIFF)
    for name in ("pose_x", "alpha_l", "beta_fl", "beta_rr", "alpha_l_reported"):
        assert soft[name] == pytest.approx(plain[name], rel=1e-3, abs=3e-5), name
    for wheel in ("fl", "rr"):
        most = soft.core.vehicle.limits.peak_torque * soft.core.vehicle.geometry.gear_ratio / STIFF
        assert soft[f"beta_{wheel}_reported"] == pytest.approx(soft[f"beta_{wheel}"], abs=most)


@pytest.mark.parametrize(("frequency", "delay"), [(1.0, 0.01), (5.0, 0.004), (20.0, 0.01)])
def test_a_late_drive_moves_its_wheel_by_the_torque_of_before(late: Any, frequency: float, delay: float) -> None:
    omega = 2 * np.pi * frequency

    def answer(dead_time: float) -> complex:
        instance = late.new(**FREE, **FRICTIONLESS)
        instance.set_parameter("time_delay.drive_fl.delay", dead_time)
        begin = round(1 / STEP)
        rates = watch(instance, lambda time: {"torque_fl": np.sin(omega * time)}, 2.0, "beta_fl_dot")[:, 0]
        return phase(rates[begin:], omega)

    expected = np.exp(-1j * omega * delay)
    error = abs(answer(delay) / answer(0.0) - expected)
    assert error <= 1.1 * (omega * delay) ** 5 / 720 + 5e-4


@pytest.mark.parametrize(("frequency", "time"), [(1.0, 0.01), (5.0, 0.02)])
def test_a_filtered_torque_moves_its_wheel_as_one_of_first_order(soft: Any, frequency: float, time: float) -> None:
    omega = 2 * np.pi * frequency

    def answer(constant: float) -> complex:
        instance = soft.new(**FREE, **FRICTIONLESS, spring_stiffness=STIFF)
        instance.set_parameter("torque_filter.drive_rr.time", constant)
        begin = round(1 / STEP)
        rates = watch(instance, lambda now: {"torque_rr": np.sin(omega * now)}, 2.0, "beta_rr_dot")[:, 0]
        return phase(rates[begin:], omega)

    assert answer(time) / answer(0.0) == pytest.approx(1 / (1 + 1j * omega * time), abs=2e-3)


def test_bristles_give_back_what_they_took_before_they_slide(core_of: Callable[..., Any]) -> None:
    """z = 1 - exp(-way/angle) on the way out; where it stops, T z is all that pulls: B_w b'' = -T z."""
    amplitude, angle, inertia = 0.5, 0.2, 0.12
    core = core_of("prototype", [make_effect("presliding", "wheel_fl", {"amplitude": amplitude, "angle": angle})])
    instance = core.new(**FREE, **FRICTIONLESS, B_w=inertia, beta_fl_dot=1.0)
    table = watch(instance, lambda _: {}, 0.2, "beta_fl", "beta_fl_dot", "bent_beta_fl_wheel_fl")
    way, rate, bent = table.T
    assert bent == pytest.approx(1 - np.exp(-way / angle), abs=1e-3)
    energy = amplitude * (way - angle * (1 - np.exp(-way / angle)))
    assert inertia * rate**2 / 2 == pytest.approx(inertia / 2 - energy, rel=2e-3)


@pytest.mark.parametrize("delay", [0.002, 0.01])
def test_a_late_encoder_reports_the_angle_of_before(late: Any, delay: float) -> None:
    omega = 2 * np.pi * 5.0
    instance = late.new(alpha_l=0.3, **FRICTIONLESS)
    instance.set_parameter("time_delay.encoder_left.delay", delay)
    instance.outputs()
    assert instance["alpha_l_reported"] == 0.3

    def swing(time: float) -> dict[str, float]:
        return {"torque_fl": -2 * np.cos(omega * time), "torque_rl": 2 * np.cos(omega * time)}

    true, reported = watch(instance, swing, 2.0, "alpha_l", "alpha_l_reported")[round(1.0 / STEP) :].T
    assert np.ptp(true) > 1e-3
    ratio = phase(reported, omega) / phase(true, omega)
    assert abs(ratio - np.exp(-1j * omega * delay)) <= (omega * delay) ** 5 / 720 + 5e-4


def ringing(instance: Any, name: str, duration: float) -> tuple[float, float]:
    """Frequency [rad/s] and damping ratio of a free vibration, from crossings and the extremes between them."""
    instance.raw.tolerance = 1e-7
    signal = watch(instance, lambda _: {}, duration, name)[:, 0]
    signal = signal - signal[-round(duration / 5 / STEP) :].mean()
    signs = np.flatnonzero(np.diff(np.sign(signal)))
    exact = signs + signal[signs] / (signal[signs] - signal[signs + 1])
    period = 2 * (exact[8] - exact[0]) / 8 * STEP
    extremes = [np.abs(signal[first:last]).max() for first, last in pairwise(signs)]
    decrement = np.log(extremes[0] / extremes[8]) / 8
    ratio = decrement / np.hypot(np.pi, decrement)
    return 2 * np.pi / period / np.sqrt(1 - ratio**2), float(ratio)


@pytest.mark.parametrize("share", [MOTOR_SHARE, 0.2])
def test_motor_and_free_wheel_swing_as_two_masses_on_a_spring(soft: Any, share: float) -> None:
    compliance = 5e-3
    instance = soft.new(gear_fl_twist=0.01, motor_share=share, **FREE, **FRICTIONLESS)
    instance.set_parameter("elasticity.drive_fl.compliance", compliance)
    reduced = share * (1 - share) * instance["B_w"]
    omega, damping = ringing(instance, "gear_fl_twist", 1.5)
    assert omega == pytest.approx(1 / np.sqrt(compliance * reduced), rel=2e-3)
    assert damping == pytest.approx(DAMPING_RATIO, rel=2e-2)


def test_both_units_of_a_side_swing_on_their_coupling(soft: Any) -> None:
    """Each has half of C_l and turns against the other in the air; they pull the chassis along, which is free too."""
    compliance = 1e-3
    instance = soft.new(coupling_l_twist=0.01, **FREE, **FRICTIONLESS)
    instance.set_parameter("elasticity.steering_left.compliance", compliance)
    half = instance["C_l"] / 2
    yaw = sum(instance[name] for name in ("C_ch", "C_l", "C_r"))
    # Lagrange: units turn by yaw + α and yaw - α + t; the twist's inertia with α and yaw moving freely.
    mass = np.array([[yaw, 0.0, half], [0.0, 2 * half, -half], [half, -half, half]])
    seen = 1 / np.linalg.inv(mass)[2, 2]
    omega, _ = ringing(instance, "coupling_l_twist", 1.5)
    assert omega == pytest.approx(1 / np.sqrt(compliance * seen), rel=2e-3)


def test_a_standing_wheel_gives_way_by_compliance_times_torque(soft: Any) -> None:
    compliance = 2e-3
    instance = soft.new(d_cw=50.0)
    instance.set_parameter("elasticity.drive_fl.compliance", compliance)
    watch(instance, lambda time: {"torque_fl": 0.5 * min(time / 0.2, 1.0)}, 2.0)
    at_wheel = 0.5 * soft.vehicle.geometry.gear_ratio
    assert instance["gear_fl_twist"] == pytest.approx(compliance * at_wheel, rel=2e-3)
    assert instance["beta_fl_reported"] - instance["beta_fl"] == instance["gear_fl_twist"]


@pytest.mark.parametrize(("place", "twist"), [("drive_fl", "gear_fl_twist"), ("steering_left", "coupling_l_twist")])
def test_what_is_lost_at_a_reversal_is_the_play(soft: Any, place: str, twist: str) -> None:
    """Friction holds one side, torque presses the other from flank to flank."""
    gap = 0.01
    instance = soft.new(d_cw=2.0, spring_stiffness=STIFF)
    instance.set_parameter(f"backlash.{place}.gap", gap)
    ends = []
    for sign in (+1, -1):
        # Pressed together for the drive; on a steering side, front against rear wheel turn both units the same way.
        for _ in range(round(0.6 / 0.002)):
            both = sign * 1.5
            instance.set(torque_fl=both, torque_rl=both, torque_fr=-both, torque_rr=-both)
            instance.step(0.002)
        ends.append(instance[twist])
    pressed = 2 * 1.5 * soft.vehicle.geometry.gear_ratio / STIFF
    assert abs(ends[0] - ends[1]) == pytest.approx(gap, abs=pressed + 3e-5)


def test_play_carries_no_torque_inside(soft: Any) -> None:
    instance = soft.new(gear_fl_twist=0.001)
    instance.set_parameter("backlash.drive_fl.gap", 0.006)
    names = [row.name for row in soft.table.block(Block.STATE)]
    rates = dict(zip(names, instance.derivatives(), strict=True))
    assert abs(rates["beta_fl_dot"]) * instance["B_w"] < 0.02


@pytest.mark.parametrize("size", [0.0, 0.003])
def test_directional_derivatives_are_exact_with_delays_and_springs(soft: Any, size: float) -> None:
    generator = np.random.default_rng(4)
    instance = soft.new(creep_stiffness=1e3, spring_stiffness=1e4)
    instance.x[:] = generator.normal(size=instance.x.size) * 0.02
    for row in soft.table.block(Block.PARAMETER):
        if "." in row.name and not row.positive:
            instance.set_parameter(row.name, size)
    blocks = (Block.STATE, Block.INPUT, Block.PARAMETER)

    def everything(block: Block, index: int, step: float) -> Array:
        moved = instance.copy()
        moved.blocks[block][index] += step
        return np.concatenate([moved.derivatives(), moved.outputs()])

    for block in blocks:
        for index, row in enumerate(soft.table.block(block)):
            if row.minimum == 0.0 and instance.blocks[block][index] == 0.0:
                continue
            seeds = [
                np.eye(soft.sizes[each])[index] if each is block else np.zeros(soft.sizes[each]) for each in blocks
            ]
            exact = instance.jacobian_vector(*seeds)
            steps = max(abs(instance.blocks[block][index]), 1e-2) * 10.0 ** np.arange(-1.5, -7.5, -0.5)
            estimates = np.array(
                [
                    (
                        everything(block, index, -2 * h)
                        - everything(block, index, 2 * h)
                        + 8 * (everything(block, index, h) - everything(block, index, -h))
                    )
                    / (12 * h)
                    for h in steps
                ]
            )
            error = np.abs(estimates - exact).min(axis=0)
            rounding = 1e-12 * np.abs(everything(block, index, 0.0)).max() / steps[4]
            assert (error <= 1e-6 * np.maximum(np.abs(exact), 1e-3 * np.abs(exact).max()) + rounding).all(), row.name
