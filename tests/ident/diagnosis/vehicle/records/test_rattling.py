"""A motor thrown to and fro in its play, integrated from first principles, tells the play and its flanks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.experiment.ideal import Drive, ideal_record
from ident.diagnosis.vehicle.records.inputs import INPUTS, SLICES
from ident.diagnosis.vehicle.records.rattling import (
    above_band,
    hammer,
    rattle_rows,
    rattling,
    rattling_at_standstill,
    swing,
)
from ident.diagnosis.vehicle.records.sliding import rolled_with_others, rolling_rates
from ident.diagnosis.vehicle.records.sources import processing_of, sources_of
from ident.diagnosis.vehicle.records.transforms import Setting, transform_cause
from ident.effects import make_effect
from ident.estimate.filters import SEVEN, Processing, differentiate, second_derivative, zero_phase
from ident.records.record import Record, Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES

Array = NDArray[np.float64]

DT = 0.002
FAST = Processing(signal_cutoff=1000.0)
GAP, COMPLIANCE = 6e-4, 5e-5
SHAKE = 2 * math.pi * 70.0


LooseMotor = Callable[..., Any]


def shaking(frequency: float) -> Callable[[Array], Array]:
    """Torque on a motor over time [Nm] that throws it about."""
    return lambda time: np.asarray(
        12 * np.sin(frequency * time) * (1 + 0.4 * np.sin(2 * time)) + 3 * np.sin(1.5 * time)
    )


def shaken(
    prototype: VehicleDescription, loose_motor: LooseMotor, gap: float = GAP
) -> tuple[Array, NDArray[np.bool_], Setting]:
    """Signals of four wheels that stand, the first motor thrown about; where it rattles; and what else is needed."""
    setting = Setting(prototype.geometry, prototype.prior.values, DT)
    angle, torque = loose_motor(gap, COMPLIANCE, setting["B_w"] / 2, damping=0.5).thrown(shaking(SHAKE), 12.0)
    fast = zero_phase(angle, FAST.signal_cutoff, DT)
    inputs = np.zeros((len(fast), INPUTS))
    columns = [
        ("beta", fast),
        ("beta_rate", differentiate(fast, DT, SEVEN)),
        ("beta_acceleration", second_derivative(fast, DT, SEVEN)),
        ("motor_acceleration", second_derivative(fast, DT, SEVEN)),
    ]
    for name, values in columns:
        inputs[:, SLICES[name].start] = values
    smooth = zero_phase(torque, FAST.signal_cutoff, DT)
    inputs[:, SLICES["torques"].start] = smooth / prototype.geometry.gear_ratio
    beta = inputs[:, SLICES["beta"]]
    rms, rattles = rattling(beta, FAST, DT)
    moved = above_band(beta, DT)
    inputs[:, SLICES["hammer"]] = np.where(rattles, hammer(moved, rms), 0.0)
    inputs[:, SLICES["swing"]] = np.where(rattles, swing(rms), 0.0)
    inputs[:, SLICES["rattle"]] = inputs[:, SLICES["hammer"]] * moved
    return inputs, rattles, setting


@pytest.mark.parametrize("true", [GAP, 2e-3])
def test_play_and_flanks_are_told_from_the_motion_above_the_band(
    prototype: VehicleDescription, loose_motor: LooseMotor, true: float
) -> None:
    """Of the wider one the load tells no more than a half: the motor is mostly in flight."""
    inputs, rattles, setting = shaken(prototype, loose_motor, true)
    cause = transform_cause(EffectName.BACKLASH, "drive_fl")

    def slow(sizes: Array) -> Array:
        """Rows of the motor without a play [mrad] and flanks [1e-5 rad/Nm]."""
        found = cause.without(inputs, sizes * [1e-3, 1e-5], setting)
        return 1e3 * zero_phase(rattle_rows((0,), setting.geometry).of(found)[:, 0], 40.0, DT)[200:-200]

    gap, compliance = least_squares(slow, [0.4, 3.0]).x * [1e-3, 1e-5]
    assert rattles[:, 0].mean() > 0.9
    assert not rattles[:, 1:].any()
    assert gap == pytest.approx(true, rel=0.03)
    assert compliance == pytest.approx(COMPLIANCE, rel=0.03)
    left, bare = slow(np.array([gap, compliance]) / [1e-3, 1e-5]), slow(np.zeros(2))
    assert np.std(left) < 0.03 * np.sqrt(np.mean(bare**2))


def test_a_motor_without_dry_friction_at_its_wheel_flies_as_well(
    prototype: VehicleDescription, loose_motor: LooseMotor
) -> None:
    inputs, _, setting = shaken(prototype, loose_motor, 2e-3)
    parameters = setting.parameters.copy()
    parameters[PARAMETER_NAMES.index("d_cw")] = 0.0
    cause = transform_cause(EffectName.BACKLASH, "drive_fl")
    for sizes in ([2e-3, COMPLIANCE], [2e-3, -1e-6], [-1e-4, COMPLIANCE]):
        assert np.all(np.isfinite(cause.without(inputs, np.array(sizes), replace(setting, parameters=parameters))))


def test_noise_that_all_encoders_share_is_no_rattling() -> None:
    noise = 1e-3 * np.random.default_rng(4).normal(size=(3000, 4))
    assert not rattling(noise, FAST, DT)[1].any()


def test_a_motor_that_rattles_for_less_than_a_tenth_of_a_drive_does_not_rattle_in_it() -> None:
    beta = np.zeros((6000, 4))
    beta[1000:1400, 2] = 1e-3 * np.sin(SHAKE * DT * np.arange(400))
    assert not rattling(beta, FAST, DT)[1].any()
    beta[1000:1700, 2] = 1e-3 * np.sin(SHAKE * DT * np.arange(700))
    assert rattling(beta, FAST, DT)[1].any(axis=0).tolist() == [False, False, True, False]


def test_where_all_motors_rattle_none_is_said_to() -> None:
    """Each in a quarter of the drive of its own: there is always a quiet one, but none that rolls throughout."""
    beta = np.zeros((8000, 4))
    for wheel in range(4):
        part = slice(2000 * wheel, 2000 * (wheel + 1))
        beta[part, wheel] = 1e-3 * np.sin(SHAKE * DT * np.arange(2000))
    assert not rattling(beta, FAST, DT)[1].any()


def test_a_wheel_made_to_roll_with_the_others_no_longer_runs_ahead(prototype: VehicleDescription) -> None:
    record = ideal_record([Drive(Step.STRAIGHT)], prototype)
    source = sources_of(record, prototype.geometry, [Step.STRAIGHT], Processing())[0]
    inputs, dt = source.inputs.copy(), source.sample_time
    ahead = 0.02 * np.sin(2 * np.arange(len(inputs)) * dt)
    inputs[:, SLICES["beta_rate"].start + 1] += ahead / prototype.geometry.wheel_radius
    found = rolled_with_others(inputs, [1], rolling_rates(inputs, [1], prototype.geometry), dt)
    left = found[:, SLICES["beta_rate"].start + 1] - rolling_rates(found, [1], prototype.geometry)[:, 0]
    assert prototype.geometry.wheel_radius * np.abs(left).max() < 0.01 * np.abs(ahead).max()
    assert np.array_equal(found[:, SLICES["beta_rate"]][:, [0, 2, 3]], inputs[:, SLICES["beta_rate"]][:, [0, 2, 3]])


def straight_and_turn(prototype: VehicleDescription, angle: Array, torque: Array) -> Record:
    """A straight drive and a turn, the motor of the third wheel shaken in the straight one."""
    record = ideal_record([Drive(Step.STRAIGHT), Drive(Step.ROTATION)], prototype)
    straight, turn = record.segments
    angles, torques = straight.wheel_angles.copy(), straight.motor_torques.copy()
    stride = round(straight.sample_time / DT)
    angles[:, 2] += np.resize(angle[::stride], len(angles))
    torques[:, 2] += np.resize(torque[::stride], len(angles)) / prototype.geometry.gear_ratio
    shaken_one = replace(straight, wheel_angles=angles, motor_torques=torques)
    return replace(record, segments=[shaken_one, turn])


@pytest.fixture(scope="module")
def hammered(prototype: VehicleDescription, loose_motor: LooseMotor) -> Record:
    """The motor is thrown about in its play."""
    seconds = ideal_record([Drive(Step.STRAIGHT)], prototype).segments[0].time[-1] + 1.0
    motor = loose_motor(GAP, COMPLIANCE, prototype.prior.values[-1] / 2, damping=0.5)
    return straight_and_turn(prototype, *motor.thrown(shaking(SHAKE / 2), seconds))


def test_rolling_says_nothing_in_a_drive_that_rattles(hammered: Record, prototype: VehicleDescription) -> None:
    processing = processing_of([hammered])
    sources = sources_of(hammered, prototype.geometry, [Step.STRAIGHT, Step.ROTATION], processing)
    assert {source.step for source in sources if source.rolls} == {Step.ROTATION}
    (rows,) = [source for source in sources if source.own is not None]
    assert (rows.step, rows.coordinates) == (Step.STRAIGHT, ("rattle_fr",))


def test_what_a_motor_moves_above_the_band_is_a_row_that_only_its_gear_explains(
    hammered: Record, prototype: VehicleDescription
) -> None:
    problem = build_problem([hammered], prototype)
    place = [block.coordinate for block in problem.blocks].index("rattle_fr")
    block = problem.blocks[place]
    explained = {
        candidate.key
        for candidate in problem.candidates
        if any(variant.columns[place] is not None for variant in candidate.variants)
    }
    assert (block.unit, block.channel) == ("m", Channel.KINEMATIC)
    assert explained == {"backlash@drive_fr", "elasticity@drive_fr"}
    assert not block.baseline.any()
    straight = hammered.segments[0]
    smooth = zero_phase(straight.wheel_angles[:, 2], processing_of([hammered]).signal_cutoff, straight.sample_time)
    rms = prototype.geometry.wheel_radius * np.std(above_band(smooth, straight.sample_time))
    assert np.sqrt(np.mean(block.target[block.moving] ** 2)) == pytest.approx(rms, rel=0.05)
    assert block.tolerance == pytest.approx(0.03 * rms, rel=0.05)


def ringing(step: Step, wheel: int, frequency: float, prototype: VehicleDescription) -> tuple[Record, float]:
    """A motor that swings freely on the compliance of its gear in a drive, and that compliance c = 1/(J_m ω² (1 - ρ)).

    The vehicle swings against it by ρ of the twist, and all wheels with it.
    """
    record = ideal_record([Drive(step)], prototype)
    (segment,) = record.segments
    omega, inertia, share = 2 * math.pi * frequency, prototype.prior.values[-1] / 2, 0.03
    twist = 5e-3 * np.sin(omega * segment.time)
    angles = segment.wheel_angles - share * twist[:, None]
    angles[:, wheel] += twist
    shaken_one = replace(segment, wheel_angles=angles)
    return replace(record, segments=[shaken_one]), 1 / (inertia * omega**2 * (1 - share))


@pytest.mark.parametrize("frequency", [28.0, 40.0, 60.0])
def test_a_motor_that_rings_tells_the_compliance_of_its_gear(frequency: float, prototype: VehicleDescription) -> None:
    record, truth = ringing(Step.STRAIGHT, 2, frequency, prototype)
    problem = build_problem([record], prototype)
    place = [block.coordinate for block in problem.blocks].index("rattle_fr")
    block, cause = problem.blocks[place], problem.candidate("elasticity@drive_fr")
    column = cause.variants[0].columns[place]
    assert column is not None
    used = block.moving
    compliance = float(column[used, 0] @ block.target[used] / (column[used, 0] @ column[used, 0]))
    assert compliance == pytest.approx(truth, rel=0.01)


def test_what_is_tolerated_of_a_motion_does_not_shrink_with_what_is_known_of_it(prototype: VehicleDescription) -> None:
    record, truth = ringing(Step.STRAIGHT, 2, 35.0, prototype)
    known = make_effect(EffectName.ELASTICITY, "drive_fr", {"compliance": truth})
    plain, given = (build_problem([record], prototype, prototype.prior, given=some) for some in ((), (known,)))
    before, after = (next(b for b in problem.blocks if b.coordinate == "rattle_fr") for problem in (plain, given))
    assert after.tolerance == before.tolerance > 0
    left, moved = (np.sqrt(np.mean(block.target[block.moving] ** 2)) for block in (after, before))
    assert left < after.tolerance < 0.05 * moved


def test_a_motor_that_rings_while_its_side_is_steered_leaves_the_forces_alone(prototype: VehicleDescription) -> None:
    """What swings back is the steered unit, by more than any other wheel shows."""
    record, _ = ringing(Step.STEERING_LEFT, 0, 35.0, prototype)
    assert {block.coordinate for block in build_problem([record], prototype).blocks} == {"alpha_l"}


@pytest.mark.parametrize("read", [1.0, 0.5], ids=["encoder in time", "encoder late"])
def test_a_unit_that_jumps_at_standstill_takes_both_of_its_motors_along_and_neither_rattles(
    read: float, prototype: VehicleDescription
) -> None:
    (segment,) = ideal_record([Drive(Step.STEERING_LEFT)], prototype).segments
    jumps = 5e-4 * np.sin(SHAKE * segment.time) * (np.sin(segment.time) > 0.8)
    steering, angles = segment.steering_angles.copy(), segment.wheel_angles.copy()
    steering[:, 0] += read * jumps
    angles[:, :2] += prototype.geometry.lever_ratio * jumps[:, None] * [-1, 1]
    jumped = Record([replace(segment, steering_angles=steering, wheel_angles=angles)])
    sources = sources_of(jumped, prototype.geometry, [Step.STEERING_LEFT], processing_of([jumped]))
    assert not any(source.rattles.any() for source in sources)
    assert [source.coordinates for source in sources if source.channel is Channel.KINEMATIC] == [("roll_fl", "roll_rl")]


@pytest.mark.parametrize("second", [0.0, 0.5, 1.0])
def test_at_standstill_motors_rattle_that_move_beside_their_unit_and_each_other(second: float) -> None:
    time = DT * np.arange(6000)
    unit, first, other = (1e-3 * np.sin(rate * time) for rate in (300.0, SHAKE, 0.8 * SHAKE))
    _, rattles = rattling_at_standstill(np.stack([unit, unit], axis=1), FAST, DT)
    assert not rattles.any()
    _, rattles = rattling_at_standstill(np.stack([first, second * other], axis=1), FAST, DT)
    assert rattles.any(axis=0).tolist() == [True, second > 0]
