"""Drives a campaign without noise and without a bus: what an effect alone changes, for its size in noise units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from emulator.prototype import Prototype
from emulator.vehicle import EmulatedVehicle
from ident.campaign.controller import Controller
from ident.campaign.plan import Plan
from ident.campaign.reference import Reference, sample_times
from ident.records.record import Record, Segment

Array = NDArray[np.float64]


def drive_quietly(plan: Plan, vehicle: EmulatedVehicle, built: Prototype) -> Record:
    """Record of a plan on a vehicle without noise, sampled and controlled in every cycle as over the bus.

    Args:
        plan: the campaign.
        vehicle: that drives it.
        built: what it was built with.

    Raises:
        UserError: the vehicle cannot drive it.
    """
    for drive in vehicle.drives:
        drive.enable()
    driver = _Driver(vehicle, plan, built)
    segments = []
    for step in plan.steps:
        start = driver.steering()
        if float(np.abs(start - plan.posture(step)).max()) > 0:
            driver.follow(plan.alignment(start, step, plan.vehicle.prior))
        segments.append(driver.follow(plan.reference(step, plan.vehicle.prior)))
    return Record(segments)


class _Driver:
    """Hands on the drives and eyes on the encoders, in vehicle signs and SI."""

    def __init__(self, vehicle: EmulatedVehicle, plan: Plan, built: Prototype) -> None:
        self._vehicle = vehicle
        self._plan = plan
        self._signs = built.drive.directions
        self._angle = 2 * np.pi / built.drive.counts_per_revolution / built.geometry.gear_ratio
        encoder = built.encoder
        self._steering = [sign * 2 * np.pi / encoder.counts_per_revolution for sign in encoder.directions]
        self._zero = encoder.zero_positions

    def steering(self) -> Array:
        """Steering angles (2,) as the encoders report them [rad]."""
        sides = zip(self._steering, self._zero, self._vehicle.encoders, strict=True)
        return np.array([unit * (encoder.position() - zero) for unit, zero, encoder in sides])

    def follow(self, reference: Reference) -> Segment:
        """Drive a reference under the controller of a campaign."""
        plan, limits = self._plan, self._plan.vehicle.limits
        controller = Controller(
            reference,
            plan.designs,
            plan.limits,
            gear_ratio=plan.vehicle.geometry.gear_ratio,
            peak_torque=limits.peak_torque,
        )
        torques, beta, alpha = [], [], []
        for index in range(len(reference)):
            beta.append(self._wheels())
            alpha.append(self.steering().tolist())
            torques.append(self._torques())
            for drive, sign, torque in zip(
                self._vehicle.drives, self._signs, controller.torques(index, beta[-1], alpha[-1]), strict=True
            ):
                drive.command(sign * torque)
            self._vehicle.advance(plan.cycle)
        return Segment(
            step=reference.step,
            sample_time=plan.cycle,
            time=sample_times(len(reference), plan.cycle),
            motor_torques=np.array(torques),
            wheel_angles=np.array(beta),
            steering_angles=np.array(alpha),
            period=reference.period,
        )

    def _wheels(self) -> list[float]:
        pairs = zip(self._signs, self._vehicle.drives, strict=True)
        return [sign * self._angle * drive.position() for sign, drive in pairs]

    def _torques(self) -> list[float]:
        pairs = zip(self._signs, self._vehicle.drives, strict=True)
        return [sign * drive.measured_torque() for sign, drive in pairs]
