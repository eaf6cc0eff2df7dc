"""The reduced model with effects moves as the FMU of the same model, whose wheels creep instead of being held."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.table import neutral_effects
from fmu.variables import Carried
from ident.effects import Effect, make_effect
from ident.effects.extended import ExtendedModel, simulation_of
from ident.estimate.filters import zero_phase
from ident.plant import dynamics
from ident.plant.modes import Mode
from ident.plant.simulation import Motion, Trajectory
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import WHEELS

Array = NDArray[np.float64]

SAMPLE_TIME, DURATION, PARTS = 0.002, 0.8, 4
CUTOFF = 60.0  # [rad/s]
HELD_STEERING = {"d_cl": 1e3, "d_cr": 1e3}
QUICK = {"stick_time": 1e9}
"""The FMU's friction without its memory, which the reduced model does not have."""

SOFT = make_effect("elasticity", "drive_fr", {"compliance": 2e-3})
LOOSE = make_effect("backlash", "drive_fl", {"gap": 0.01})
SOFT_SIDE = make_effect("elasticity", "steering_left", {"compliance": 5e-4})
LOOSE_SIDE = make_effect("backlash", "steering_right", {"gap": 0.005})
LATE = make_effect("time_delay", "drive_rl", {"delay": 0.008})
SLOW = make_effect("torque_filter", "drive_fr", {"time": 0.02})
LOSSY = make_effect("friction_load", "wheels", {"share": 0.1})
BRISTLES = make_effect("presliding", "wheels", {"amplitude": 2.0, "angle": 0.05})
BRISTLES_OF_A_SIDE = make_effect("presliding", "steering_left", {"amplitude": 4.0, "angle": 0.05})


def swinging(mode: Mode, vehicle: VehicleDescription) -> tuple[Motion, Array]:
    """A start at rest, and torques (N, 4) of a motion to and fro."""
    time, omega = np.arange(0, DURATION, SAMPLE_TIME)[:, None], 2 * np.pi / DURATION
    width = {Mode.ALIGNMENT: [0.3, 0.2], Mode.STEERED: [0.0, 0.02], Mode.LATERAL: [0.02], Mode.ROTATION: [0.02]}[mode]
    velocity = np.array(width) * omega * (np.cos(omega * time) - np.cos(2 * omega * time))
    acceleration = np.array(width) * omega**2 * (2 * np.sin(2 * omega * time) - np.sin(omega * time))
    angle = {Mode.LATERAL: np.pi / 2, Mode.ROTATION: vehicle.geometry.rotation_angle}.get(mode, 0.0)
    alpha = np.tile([-angle, angle], (len(time), 1))
    torques = dynamics.feed_forward(mode, alpha, velocity, acceleration, vehicle.prior.values, vehicle.geometry)
    torques[:2] = 0.0  # so that what gives way rests, in the FMU too
    return Motion(np.zeros(1), alpha[:1], np.zeros((1, 4)), np.zeros((1, len(width)))), torques


def reduced(
    effects: tuple[Effect, ...], mode: Mode, vehicle: VehicleDescription, parameters: dict[str, float]
) -> Trajectory:
    start, torques = swinging(mode, vehicle)
    model = ExtendedModel(vehicle.prior.replaced(**parameters), effects)
    return simulation_of(model, mode, vehicle.geometry).run(start, torques[None], SAMPLE_TIME)


def in_the_fmu(core: Any, mode: Mode, injected: dict[str, float], **parameters: float) -> dict[str, Array]:
    start, torques = swinging(mode, core.vehicle)
    instance = core.new(alpha_l=start.alpha[0, 0], alpha_r=start.alpha[0, 1], **QUICK, **parameters)
    names = [f"beta_{wheel}_dot" for wheel in WHEELS] + ["alpha_l_dot", "alpha_r_dot"]
    twists = [row.name for row in core.table.variables if row.name.endswith("_twist_dot")]
    found = [[instance[name] for name in names + twists]]
    for before, after in pairwise(torques):
        if len(found) == 2:
            instance.set(**injected)
        for part in range(PARTS):
            share = (part + 0.5) / PARTS
            instance.u[:4] = (1 - share) * before + share * after
            instance.step(SAMPLE_TIME / PARTS)
        found.append([instance[name] for name in names + twists])
    return dict(zip(names + twists, np.array(found).T, strict=True))


ELASTIC, PLAY, SMOOTH = 0.15, 0.25, 0.05
"""Part of what the effect does that may be left. A motor bounces between flanks, which no two solvers do alike."""
CASES = [
    (Mode.STEERED, (SOFT, LATE), {}, ELASTIC),
    (Mode.ROTATION, (LOOSE,), HELD_STEERING, PLAY),
    pytest.param(Mode.LATERAL, (SOFT,), HELD_STEERING, ELASTIC, marks=pytest.mark.slow),
    pytest.param(Mode.ALIGNMENT, (SOFT_SIDE,), {}, ELASTIC, marks=pytest.mark.slow),
    (Mode.ALIGNMENT, (LOOSE_SIDE,), {}, PLAY),
    (Mode.ROTATION, (SLOW,), HELD_STEERING, SMOOTH),
    (Mode.STEERED, (LOSSY,), {}, SMOOTH),
    (Mode.LATERAL, (BRISTLES,), HELD_STEERING, SMOOTH),
    (Mode.ALIGNMENT, (BRISTLES_OF_A_SIDE,), {}, SMOOTH),
    pytest.param(Mode.ROTATION, (LOSSY, SOFT), HELD_STEERING, ELASTIC, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("mode", "effects", "parameters", "part"), CASES)
def test_what_gives_way_or_is_late_moves_as_in_the_fmu(
    core_of: Callable[..., Any], mode: Mode, effects: tuple[Effect, ...], parameters: dict[str, float], part: float
) -> None:
    core = core_of("prototype", effects)
    assert_moves_as_the_reduced_model(core, mode, effects, parameters, {}, part)


WARMING = make_effect("friction_warming", "wheel_fl", {"change": 4.0, "time": 0.3})
CHANGED = make_effect("parameter_change", "d_cw", {"change": 0.5})
WEAK = make_effect("torque_gain", "drive_rl", {"error": -0.3})


@pytest.mark.parametrize(
    ("mode", "effects", "parameters", "part"),
    [
        (Mode.STEERED, (SOFT, LATE), {}, ELASTIC),
        (Mode.STEERED, (WARMING,), HELD_STEERING, 0.1),
        (Mode.STEERED, (CHANGED,), {}, 0.1),
        (Mode.STEERED, (WEAK,), HELD_STEERING, 0.1),
        pytest.param(Mode.ROTATION, (LOOSE,), HELD_STEERING, PLAY, marks=pytest.mark.slow),
        pytest.param(Mode.ALIGNMENT, (SOFT_SIDE,), {}, ELASTIC, marks=pytest.mark.slow),
    ],
)
def test_an_effect_of_size_zero_that_is_given_a_size_moves_as_the_reduced_model_that_has_it(
    core_of: Callable[..., Any], mode: Mode, effects: tuple[Effect, ...], parameters: dict[str, float], part: float
) -> None:
    """All effects are inside, at every place; the vehicle stands for a step before one of them is injected."""
    core = core_of("prototype", neutral_effects(Carried.ALL))
    injected = {
        f"{effect.name}.{effect.where}.{name}": quantity.value
        for effect in effects
        for name, quantity in effect.parameters.items()
    }
    assert_moves_as_the_reduced_model(core, mode, effects, parameters, injected, part)


def assert_moves_as_the_reduced_model(
    core: Any,
    mode: Mode,
    effects: tuple[Effect, ...],
    parameters: dict[str, float],
    injected: dict[str, float],
    part: float,
) -> None:
    fmu = in_the_fmu(core, mode, injected, **parameters)
    model, plain = (reduced(each, mode, core.vehicle, parameters).readings for each in (effects, ()))
    motors = np.stack([fmu[f"beta_{w}_dot"] + fmu.get(f"gear_{w}_twist_dot", 0.0) for w in WHEELS], axis=1)
    compared = [(motors, model.wheel_rates[0], plain.wheel_rates[0])]
    if mode is Mode.ALIGNMENT:
        steering = np.stack([fmu["alpha_l_dot"], fmu["alpha_r_dot"]], axis=1)
        compared.append((steering, model.steering_rates[0], plain.steering_rates[0]))
    for rates in compared:
        expected, actual, without = (zero_phase(each, CUTOFF, SAMPLE_TIME) for each in rates)
        effect, left = (np.sqrt(np.mean((expected - each) ** 2)) for each in (without, actual))
        assert left < part * effect
