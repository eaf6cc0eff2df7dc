"""Effects without a candidate: physical, and of names that no library has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from emulator.effects import INJECTORS, Unlibraried, inject
from emulator.effects.laws import Moment
from emulator.engine.protocol import MakeEngine
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle

STEP = 1e-3
STRANGERS = sorted(name for name, injector in INJECTORS.items() if not injector.known)


def moment(angles: list[float], rates: list[float], drives: list[float]) -> Moment:
    return Moment(0.0, None, angles, rates, [0.0] * 8, drives, [1.0] * 8)


def obey(effect: Unlibraried, now: Moment) -> Moment:
    for law in inject(load_prototype(), [effect], STEP).laws:
        law(now)
    return now


def test_a_weakened_field_takes_a_share_that_grows_with_the_square_of_speed() -> None:
    drives = [8.0, -6.0, 4.0, 2.0]
    now = obey(Unlibraried("field_weakening", "wheels", 1e-3), moment([0.0] * 8, [0.0] * 4 + [10.0] * 4, drives))
    assert now.torques[4:] == pytest.approx([-0.1 * torque for torque in drives])


def test_hoses_pull_both_units_of_their_side_to_straight_ahead() -> None:
    now = obey(
        Unlibraried("hose_spring", "steering_right", 3.0),
        moment([0.1, -0.1, 0.4, -0.4, 0, 0, 0, 0], [0.0] * 8, [0.0] * 4),
    )
    assert now.torques == pytest.approx([0.0, 0.0, -0.6, 0.6, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("name", STRANGERS)
def test_the_emulator_drives_with_each(name: str, drive_straight: Callable[..., float]) -> None:
    sizes = {"floor_waves": 40.0, "field_weakening": 0.02}
    effect = Unlibraried(name, INJECTORS[name].places[0], sizes.get(name, 5.0))
    plain, changed = drive_straight(), drive_straight(effect)
    assert (abs(plain - changed) > 1e-5) is (name != "hose_spring")


@pytest.fixture
def drive_straight(make_engine: MakeEngine) -> Callable[..., float]:
    def drive(*effects: Unlibraried) -> float:
        prototype = load_prototype()
        with EmulatedVehicle(prototype, seed=1, noise_scale=0.0, make_engine=make_engine, effects=effects) as vehicle:
            for drive, sign in zip(vehicle.drives, (1, 1, -1, -1), strict=True):
                drive.enable()
                drive.command(sign * 0.6)
            vehicle.advance(1.0)
            return float(np.asarray(vehicle.ground_truth().pose)[0])

    return drive
