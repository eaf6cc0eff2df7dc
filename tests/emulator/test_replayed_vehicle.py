"""Recorded torques through the emulated vehicle: it does again what it did."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from emulator.effects import Unlibraried, Wanted
from emulator.engine.protocol import MakeEngine
from emulator.prototype import Prototype, load_prototype
from emulator.replay import ReplayedVehicle, Start
from emulator.vehicle import EmulatedVehicle
from ident.effects.text import parse_effect

CYCLE = 2e-3
STEPS = 2


def recorded(
    prototype: Prototype, make_engine: MakeEngine, effects: Sequence[Wanted], cycles: int = 400
) -> tuple[np.ndarray, np.ndarray, list[list[float]]]:
    """Torques (N, 4), readings (N, 6) and joint rates and twist (N, 11) of a vehicle without noise, its motors swinging."""
    torques, readings, rates = [], [], []
    with EmulatedVehicle(prototype, seed=0, noise_scale=0.0, make_engine=make_engine, effects=effects) as vehicle:
        directions, gear = prototype.drive.directions, prototype.geometry.gear_ratio
        for drive in vehicle.drives:
            drive.enable()
        for cycle in range(cycles):
            swing = 0.9 * math.sin(2 * math.pi * 0.8 * cycle * CYCLE)
            steer = 0.5 * math.sin(2 * math.pi * 1.1 * cycle * CYCLE)
            for drive, sign, direction in zip(vehicle.drives, (-1, 1, -1, 1), directions, strict=True):
                drive.command(direction * (swing + sign * steer))
            torques.append([drive.wheel_torque / gear for drive in vehicle.drives])
            mechanics = vehicle._mechanics
            angles = [mechanics.steering.steering_angle(side) for side in range(2)]
            readings.append([*angles, *(mechanics.shafts.wheel_angle(wheel) for wheel in range(4))])
            now = vehicle.engine.mean_rates()
            moved = [mechanics.shafts.wheel_rate(wheel) for wheel in range(4)]
            turning = moved if mechanics.shafts is not vehicle.engine else now[4:]
            rates.append([*now[:4], *turning, *vehicle.engine.twist()])
            vehicle.advance(CYCLE)
    return np.array(torques), np.array(readings), rates


@pytest.mark.parametrize(
    ("effect", "tolerance"),
    [
        (None, 1e-4),
        ("stribeck@steering_left=4Nm", 1e-4),
        ("torque_bias@drive_fl=0.05Nm", 1e-4),
        ("quadratic_drag@chassis=40N s^2/m^2", 1e-4),
        ("steering_offset@steering_right=20mrad", 1e-4),
        ("time_delay@encoder_left=4ms", 2e-3),
        ("time_delay@drive_rl=6ms", 2e-3),
        ("elasticity@drive_rr=0.003rad/Nm", 5e-3),
    ],
)
def test_from_rest_it_does_what_the_vehicle_did(make_engine: MakeEngine, effect: str | None, tolerance: float) -> None:
    """All 0.8 s long, every reading; what remembers starts settled, as the vehicle does."""
    prototype = load_prototype()
    effects = () if effect is None else (parse_effect(effect),)
    torques, readings, _ = recorded(prototype, make_engine, effects)
    with ReplayedVehicle(prototype, effects=effects, make_engine=make_engine) as vehicle:
        start = Start(0.0, 0.0, (0.0,) * 3, tuple(readings[0, :2]), tuple(readings[0, 2:]), (0.0,) * 2, (0.0,) * 4)
        again = np.array(vehicle.run(start, torques.tolist(), STEPS))
    moved = np.ptp(readings, axis=0)
    assert moved.max() > 0.2
    assert np.abs(again - readings).max() < tolerance * moved.max() + 2e-4


@pytest.mark.parametrize("effect", [None, "asymmetric_coulomb@steering_right=3Nm"])
def test_from_the_middle_of_a_motion_it_goes_on(make_engine: MakeEngine, effect: str | None) -> None:
    prototype = load_prototype()
    effects = () if effect is None else (parse_effect(effect),)
    torques, readings, rates = recorded(prototype, make_engine, effects)
    begin, now = 150, rates[150]
    with ReplayedVehicle(prototype, effects=effects, make_engine=make_engine) as vehicle:
        angles = tuple(readings[begin, :2]), tuple(readings[begin, 2:])
        start = Start(0.3, 0.0, tuple(now[8:]), *angles, (now[0], now[2]), tuple(now[4:8]))
        again = np.array(vehicle.run(start, torques[begin : begin + 150].tolist(), STEPS))
    moved = np.ptp(readings[begin : begin + 150], axis=0)
    assert moved.max() > 0.05
    assert np.abs(again - readings[begin : begin + 150]).max() < 0.03 * moved.max()


def test_an_effect_that_no_vehicle_can_have_is_refused() -> None:
    from ident.errors import UserError

    with pytest.raises(UserError, match="no such effect"):
        ReplayedVehicle(load_prototype(), effects=(Unlibraried("gremlins", "chassis", 1.0),))
