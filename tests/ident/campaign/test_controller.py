"""The controller on rigid axes behind a dead time, with parameters away from those it was designed with."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.campaign.controller import Controller, FollowingError
from ident.campaign.plan import Plan
from ident.campaign.reference import Reference, Track
from ident.plant import kinematics
from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]
CYCLE = 0.002
DEAD_CYCLES = 2
SUBSTEPS = 10


@dataclass
class RigidVehicle:
    """Coordinates that move along constant columns of wheel rates, each with inertia and dry friction that sticks.

    Args:
        columns: (n, 4) wheel rates per rate of a coordinate.
        inertia, viscous, coulomb: (n,) of the coordinates, wheels included.
        gear_ratio: of the motors.
        start: (n,) positions.
    """

    columns: Array
    inertia: Array
    viscous: Array
    coulomb: Array
    gear_ratio: float
    start: Array
    position: Array = field(init=False)
    rate: Array = field(init=False)

    def __post_init__(self) -> None:
        self.position, self.rate = self.start.copy(), np.zeros(len(self.start))
        self._pending: deque[Array] = deque([np.zeros(4)] * DEAD_CYCLES)

    def wheels(self) -> list[float]:
        turned: list[float] = ((self.position - self.start) @ self.columns).tolist()
        return turned

    def drive(self, motor_torques: Sequence[float]) -> None:
        self._pending.append(np.asarray(motor_torques))
        force = self.columns @ (self.gear_ratio * self._pending.popleft())
        step = CYCLE / SUBSTEPS
        for _ in range(SUBSTEPS):
            free = self.rate + step * (force - self.viscous * self.rate) / self.inertia
            stopped = np.maximum(np.abs(free) - step * self.coulomb / self.inertia, 0.0)
            self.rate = np.sign(free) * stopped
            self.position = self.position + step * self.rate


def rigid(step: Step, plan: Plan, truth: Parameters) -> RigidVehicle:
    """Both steering sides at their posture, and the chassis coordinate of the step where it has one."""
    geometry, posture = plan.vehicle.geometry, plan.posture(step)
    steering = kinematics.complement(Mode.ALIGNMENT, posture, geometry)[0, 5:].T
    wheels = (truth["B_w"], truth["d_vw"], truth["d_cw"])
    own = [(truth["C_l"], truth["d_vl"], truth["d_cl"]), (truth["C_r"], truth["d_vr"], truth["d_cr"])]
    columns = [*steering]
    chassis = {Step.STRAIGHT: (Mode.STEERED, 1), Step.ROTATION: (Mode.ROTATION, 0)}.get(step)
    if chassis is not None:
        columns.append(kinematics.complement(chassis[0], posture, geometry)[0, 5:, chassis[1]])
        yaw = truth["C_ch"] + truth["C_l"] + truth["C_r"]
        own.append((truth["m_ch"] if step is Step.STRAIGHT else yaw, 0.0, 0.0))
    squares, sizes = np.sum(np.square(columns), axis=1), np.sum(np.abs(columns), axis=1)
    inertia, viscous, coulomb = np.array(own).T
    return RigidVehicle(
        np.array(columns),
        inertia + wheels[0] * squares,
        viscous + wheels[1] * squares,
        coulomb + wheels[2] * sizes,
        geometry.gear_ratio,
        np.array([*posture, *([0.0] if chassis else [])]),
    )


def controller(plan: Plan, reference: Reference) -> Controller:
    return Controller(
        reference,
        plan.designs,
        plan.limits,
        gear_ratio=plan.vehicle.geometry.gear_ratio,
        peak_torque=plan.vehicle.limits.peak_torque,
    )


def run(plan: Plan, reference: Reference, vehicle: RigidVehicle) -> tuple[Array, Array]:
    """Positions (N, n) and motor torques (N, 4)."""
    loops = controller(plan, reference)
    positions, torques = [], []
    for index in range(len(reference)):
        u = loops.torques(index, vehicle.wheels(), vehicle.position[:2].tolist())
        vehicle.drive(u)
        positions.append(vehicle.position)
        torques.append(u)
    return np.array(positions), np.array(torques)


@pytest.fixture(scope="module")
def truth(vehicle: VehicleDescription) -> Parameters:
    """15 % off the prior, friction by a quarter."""
    return vehicle.prior.replaced(
        **{name: 1.15 * vehicle.prior[name] for name in ("m_ch", "C_ch", "C_l", "B_w")},
        **{name: 0.75 * vehicle.prior[name] for name in ("d_cw", "d_cl", "d_vr")},
    )


def one_period(reference: Reference) -> Reference:
    """Standstill, the first repeat, standstill."""
    rows = reference.period <= 0
    tracks = {
        name: Track(track.position[rows], track.velocity[rows], track.wheels[rows])
        for name, track in reference.tracks.items()
    }
    return replace(
        reference,
        tracks=tracks,
        feed_forward=reference.feed_forward[rows],
        period=reference.period[rows],
        path=reference.path[rows],
    )


@pytest.mark.parametrize("step", [Step.STEERING_LEFT, Step.STRAIGHT, Step.ROTATION])
def test_a_vehicle_that_differs_from_its_prior_follows_its_reference(step: Step, plan: Plan, truth: Parameters) -> None:
    reference = one_period(plan.reference(step, plan.vehicle.prior))
    positions, torques = run(plan, reference, rigid(step, plan, truth))
    assert np.abs(torques).max() <= plan.vehicle.limits.peak_torque
    for column, (name, track) in enumerate(reference.tracks.items()):
        error = np.abs(positions[:, column] - track.position)
        assert error.max() < 0.2 * plan.limits[name].following_error, name
        assert error.max() < 0.1 * max(np.ptp(track.position), 0.05), name


@pytest.mark.parametrize("step", [Step.ROTATION, Step.STRAIGHT])
def test_an_alignment_ends_on_its_target_against_dry_friction(step: Step, plan: Plan, truth: Parameters) -> None:
    start = np.array([0.3, 0.5])
    reference = plan.alignment(start, step, plan.vehicle.prior)
    vehicle = rigid(Step.STEERING_LEFT, plan, truth)
    vehicle.start = vehicle.position = start
    positions, _ = run(plan, reference, vehicle)
    np.testing.assert_allclose(positions[-1], plan.posture(step), atol=1e-3)


Drive = Callable[[RigidVehicle, list[float]], None]


def drive_through(plan: Plan, step: Step, truth: Parameters, drive: Drive) -> None:
    reference = plan.reference(step, plan.vehicle.prior)
    vehicle, loops = rigid(step, plan, truth), controller(plan, reference)
    for index in range(len(reference)):
        drive(vehicle, loops.torques(index, vehicle.wheels(), vehicle.position[:2].tolist()))


def test_a_wrong_direction_of_rotation_stops_the_campaign(plan: Plan, truth: Parameters) -> None:
    def backwards(vehicle: RigidVehicle, torques: list[float]) -> None:
        vehicle.drive([-torque for torque in torques])

    with pytest.raises(FollowingError, match="x is ") as caught:
        drive_through(plan, Step.STRAIGHT, truth, backwards)
    assert caught.value.coordinate == "x"
    assert "direction of rotation" in caught.value.remedy


def test_a_blocked_steering_side_stops_the_campaign(plan: Plan, truth: Parameters) -> None:
    def blocked(vehicle: RigidVehicle, torques: list[float]) -> None:
        vehicle.drive(torques)
        vehicle.position, vehicle.rate = vehicle.start.copy(), np.zeros(len(vehicle.start))

    with pytest.raises(FollowingError) as caught:
        drive_through(plan, Step.STEERING_LEFT, truth, blocked)
    assert caught.value.coordinate == "alpha_l"


def test_wheels_in_the_air_that_do_not_turn_stop_the_campaign(plan: Plan) -> None:
    reference = plan.reference(Step.WHEEL_LIFTED, plan.vehicle.prior)
    loops = controller(plan, reference)
    late = int(np.argmax(np.abs(reference.tracks["beta_fl"].position)))
    with pytest.raises(FollowingError) as caught:
        loops.torques(late, [0.0] * 4, [0.0, 0.0])
    assert caught.value.coordinate == "beta_fl"
    assert f"sample {late}" in caught.value.what


def test_feed_forward_alone_is_commanded_while_the_vehicle_is_where_it_should_be(plan: Plan) -> None:
    """Angles exactly on the reference: no feedback, as long as differencing the position sees the right rate."""
    reference = plan.reference(Step.STRAIGHT, plan.vehicle.prior)
    loops, track = controller(plan, reference), reference.tracks["x"]
    wheels = track.position[:, None] * track.wheels
    peak = np.abs(reference.feed_forward).max()
    found = np.array([loops.torques(i, wheels[i].tolist(), [0.0, 0.0]) for i in range(2000)])
    np.testing.assert_allclose(found, reference.feed_forward[:2000], atol=0.05 * peak)


def test_torques_are_cut_at_the_peak_of_the_motors(plan: Plan) -> None:
    reference = plan.reference(Step.STRAIGHT, plan.vehicle.prior)
    loops = controller(plan, reference)
    loops.torques(0, [0.0] * 4, [0.0, 0.0])
    jerked = loops.torques(1, [-1.0] * 4, [0.0, 0.0])
    assert jerked == [plan.vehicle.limits.peak_torque] * 4
