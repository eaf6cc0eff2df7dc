"""What a better model is worth in closed loop: the lane change driven on the emulator, feed-forward by each model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil.bench import emulation
from hil.bench.prototypes import load_emulated
from hil.bus.realtime import steady_memory
from hil.master.master import Master
from ident.campaign.controller import Controller
from ident.campaign.extended_reference import with_effects
from ident.campaign.plan import Plan
from ident.campaign.reference import STEERING_LOOPS, Reference
from ident.effects import Effect
from ident.effects.extended import ExtendedModel
from ident.extras import EngineName
from ident.records.record import Step

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tracking:
    """How well a lane change was followed, rms from the first to the last motion of the reference.

    Attributes:
        steering: error of both steering angles [rad].
        travel: error of the wheels' mean travel [m].
    """

    steering: float
    travel: float


def track_lane_change(
    plan: Plan,
    model: ExtendedModel,
    *,
    prototype: str,
    seed: int,
    network: Path,
    effects: Sequence[Effect],
    engine: EngineName | None = None,
) -> Tracking:
    """Drive the lane change of a plan over CAN, in lockstep.

    Args:
        plan: gives the manoeuvre and the loops.
        model: gives the feed-forward.
        prototype: vehicle of the emulator.
        seed: of its noise.
        network: of the vehicle.
        effects: that the vehicle has.
        engine: of its physics; None: the first that is installed.
    """
    reference = plan.reference(Step.LANE_CHANGE, model.parameters)
    if model.effects:
        reference = with_effects(reference, model, plan.vehicle.geometry)
    with (
        emulation.bench(prototype, seed, False, network, effects, engine=engine) as bench,
        steady_memory(),
        Master(bench.bus, bench.clock, load_emulated(prototype, network).network) as master,
    ):
        master.boot()
        master.enable()
        steering, wheels = _follow(master, reference, plan)
    return _tracking(reference, steering, wheels, plan.vehicle.geometry.wheel_radius)


def _follow(master: Master, reference: Reference, plan: Plan) -> tuple[Array, Array]:
    """Steering (N, 2) and wheel angles (N, 4) [rad] while the reference is followed."""
    geometry, limits = plan.vehicle.geometry, plan.vehicle.limits
    controller = Controller(
        reference, plan.designs, plan.limits, gear_ratio=geometry.gear_ratio, peak_torque=limits.peak_torque
    )
    sample = master.exchange((0.0, 0.0, 0.0, 0.0))
    steering, wheels = [sample.steering_angles], [sample.wheel_angles]
    for index in range(len(reference) - 1):
        sample = master.exchange(controller.torques(index, sample.wheel_angles, sample.steering_angles))
        steering.append(sample.steering_angles)
        wheels.append(sample.wheel_angles)
    return np.array(steering), np.array(wheels)


def _tracking(reference: Reference, steering: Array, wheels: Array, radius: float) -> Tracking:
    wanted = np.stack([reference.tracks[loop].position for loop in STEERING_LOOPS], axis=1)
    travel = reference.tracks["x"]
    speed = travel.wheels * travel.velocity[:, None]
    for loop in STEERING_LOOPS:
        speed = speed + reference.tracks[loop].wheels * reference.tracks[loop].velocity[:, None]
    rolled = np.cumsum(speed, axis=0) * reference.sample_time
    moving = np.flatnonzero(np.abs(travel.velocity) > 0)
    window = slice(int(moving[0]), int(moving[-1]) + 1)
    lag = radius * ((wheels - wheels[0]) - rolled).mean(axis=1)[window]
    return Tracking(float(np.sqrt(np.mean((steering - wanted)[window] ** 2))), float(np.sqrt(np.mean(lag**2))))
