"""The engine obeys the reduced equations of motion: driven, then fitted with exact signals.

One generalised coordinate s at a time, written down here from the geometry alone: with the levers c_i by
which wheel i rolls when s moves, beta_i' = c_i s', the reduced equation is

    (J + sum c_i^2 B_w) s'' + (d_v + sum c_i^2 d_vw) s' + (d_c + sum |c_i| d_cw) sign s' = i_G sum c_i u_i.

Run as a script, this file prints the table of docs/emulator.md.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module

import numpy as np
import pytest

from emulator.engine.choice import ENGINES
from emulator.engine.protocol import MakeEngine
from emulator.prototype import Prototype, load_prototype
from emulator.vehicle import EmulatedVehicle, GroundTruth
from ident.extras import EngineName

CYCLE = 2e-3


@dataclass(frozen=True)
class Experiment:
    """One coordinate: its levers, how it is read, its own inertia and friction, how it is driven."""

    levers: np.ndarray
    read: Callable[[GroundTruth], tuple[float, float]]
    inertia: float
    viscous: float
    coulomb: float
    amplitude: float
    bandwidth: float
    slowest: float
    angles: tuple[float, float] = (0.0, 0.0)
    lifted: bool = False


@dataclass(frozen=True)
class Bias:
    """Relative errors of the fitted totals, and what moved that should not have."""

    inertia: float
    viscous: float
    coulomb: float
    residual: float
    creep: float
    coupling: float


def experiments(prototype: Prototype) -> dict[str, Experiment]:
    g, p = prototype.geometry, prototype.truth
    rho, r = g.wheel_offset / g.wheel_radius, g.wheel_radius
    lever = (math.hypot(g.wheelbase, g.track_width) / 2 + g.wheel_offset) / r
    rotation = math.atan2(g.wheelbase, g.track_width)
    yaw = p["C_ch"] + p["C_l"] + p["C_r"]
    return {
        "steering_left": Experiment(
            rho * np.array([-1.0, 1.0, 0.0, 0.0]),
            lambda now: (now.steering_angles[0], now.steering_rates[0]),
            p["C_l"], p["d_vl"], p["d_cl"], 0.35, 40.0, 0.05,
        ),
        "steering_right": Experiment(
            rho * np.array([0.0, 0.0, 1.0, -1.0]),
            lambda now: (now.steering_angles[1], now.steering_rates[1]),
            p["C_r"], p["d_vr"], p["d_cr"], 0.35, 40.0, 0.05,
        ),
        "straight": Experiment(
            np.array([1.0, 1.0, 1.0, 1.0]) / r,
            lambda now: (now.pose[0], now.twist[0]),
            p["m_ch"], 0.0, 0.0, 0.18, 10.0, 0.01,
        ),
        "rotation": Experiment(
            lever * np.array([-1.0, -1.0, 1.0, 1.0]),
            lambda now: (now.pose[2], now.twist[2]),
            yaw, 0.0, 0.0, 0.15, 10.0, 0.02, angles=(-rotation, rotation),
        ),
        # Nothing but dry friction holds the steering here: net force F steers each side with F a / 2.
        "lateral": Experiment(
            np.array([-1.0, 1.0, 1.0, -1.0]) / r,
            lambda now: (now.pose[1], now.twist[1]),
            p["m_ch"], 0.0, 0.0, 0.008, 10.0, 0.003, angles=(-math.pi / 2, math.pi / 2),
        ),
        "wheel_lifted": Experiment(
            np.array([1.0, 0.0, 0.0, 0.0]),
            lambda now: (now.wheel_angles[0], now.wheel_rates[0]),
            0.0, 0.0, 0.0, 2.0, 15.0, 0.1, lifted=True,
        ),
    }  # fmt: skip


def desired(time: float, amplitude: float) -> tuple[float, float, float]:
    """Three sines and their derivatives, faded in within a second."""
    frequency, share = np.array([1.9, 3.1, 4.7]), np.array([1.0, -0.6, 0.35]) * min(1.0, time) * amplitude
    sine, cosine = np.sin(frequency * time), np.cos(frequency * time)
    return (
        float(share @ sine),
        float(share @ (frequency * cosine)),
        -float(share @ (frequency**2 * sine)),
    )


def drive_and_fit(
    prototype: Prototype,
    name: str,
    *,
    duration: float,
    step: float = 1e-3,
    make_engine: MakeEngine | None = None,
    sampled: bool = False,
) -> Bias:
    """Drive one experiment in closed loop without noise and fit J, d_v, d_c by least squares.

    `sampled` fits what a bus sees, position and reported torque every CYCLE; else every engine step counts.
    """
    experiment = experiments(prototype)[name]
    truth, ratio = prototype.truth, prototype.geometry.gear_ratio
    spread = float(experiment.levers @ experiment.levers)
    totals = np.array(
        [
            experiment.inertia + spread * truth["B_w"],
            experiment.viscous + spread * truth["d_vw"],
            experiment.coulomb + float(np.abs(experiment.levers).sum()) * truth["d_cw"],
        ]
    )
    directions = np.array(prototype.drive.directions)
    share = directions * experiment.levers / spread / ratio
    stiffness = totals[0] * experiment.bandwidth**2
    damping = 2 * totals[0] * experiment.bandwidth
    position, torque, truths = [], [], []
    with EmulatedVehicle(prototype, seed=1, noise_scale=0.0, engine_step=step, make_engine=make_engine) as vehicle:
        left, right = experiment.angles
        vehicle.engine.place(on_stand=True, angles=[left, -left, right, -right, 0.0, 0.0, 0.0, 0.0])
        if not experiment.lifted:
            vehicle.lower()
        for drive in vehicle.drives:
            drive.enable()
        per_cycle = round(CYCLE / step)
        for index in range(round(duration / step)):
            now = vehicle.ground_truth()
            at, speed = experiment.read(now)
            if index % per_cycle == 0:
                goal, goal_speed, goal_acceleration = desired(index * step, experiment.amplitude)
                force = float(totals @ [goal_acceleration, goal_speed, math.tanh(goal_speed / 0.02)])
                force += stiffness * (goal - at) + damping * (goal_speed - speed)
                for drive, part in zip(vehicle.drives, share, strict=True):
                    drive.command(part * force)
            position.append(at)
            torque.append([drive.measured_torque() for drive in vehicle.drives])
            truths.append(now)
            vehicle.advance(step)
    stride = per_cycle if sampled else 1
    force_seen = ratio * (np.array(torque) * directions) @ experiment.levers
    fitted, residual = fit(np.array(position)[::stride], force_seen[::stride], step * stride, experiment.slowest)
    own = totals[0] - spread * truth["B_w"] or totals[0]
    relative = (fitted - totals) / [own, totals[1], totals[2]]
    start = truths[0].pose
    return Bias(
        *relative,
        residual=residual,
        creep=max(math.hypot(now.pose[0] - start[0], now.pose[1] - start[1]) for now in truths),
        coupling=max(abs(error) for now in truths for error in now.coupling_error),
    )


def fit(position: np.ndarray, force: np.ndarray, step: float, slowest: float) -> tuple[np.ndarray, float]:
    """Least squares on central differences, which are exact for leapfrog; slow rows and the fade-in drop out."""
    speed = (position[2:] - position[:-2]) / (2 * step)
    acceleration = (position[2:] - 2 * position[1:-1] + position[:-2]) / step**2
    rows = (np.abs(speed) > slowest) & (np.arange(len(speed)) * step > 1.0)
    regressor = np.column_stack([acceleration, speed, np.sign(speed)])[rows]
    fitted = np.linalg.lstsq(regressor, force[1:-1][rows], rcond=None)[0]
    return fitted, float(np.std(regressor @ fitted - force[1:-1][rows]))


BOUNDS = {
    "steering_left": (2e-3, 5e-4, 2e-4),
    "steering_right": (2e-3, 5e-4, 2e-4),
    "straight": (5e-5, 2e-4, 1e-4),
    "rotation": (5e-5, 2e-4, 1e-4),
    "lateral": (2e-4, 2e-3, 1e-4),
    "wheel_lifted": (5e-5, 2e-4, 1e-4),
}
"""Relative bias of inertia, viscous and Coulomb friction that each experiment stays under."""


CONVERGED = {EngineName.PYBULLET: ["iterations=300"], EngineName.MUJOCO: []}
"""Settings with which the solver leaves nothing over; MuJoCo's never does."""


@pytest.mark.parametrize("prototype_name", ["prototype", "compact"])
@pytest.mark.parametrize("name", list(BOUNDS))
def test_every_engine_obeys_the_reduced_equation_of_motion(
    prototype_name: str, name: str, make_engine: MakeEngine
) -> None:
    bias = drive_and_fit(load_prototype(prototype_name), name, duration=5.0, make_engine=make_engine)
    inertia, viscous, coulomb = BOUNDS[name]
    assert abs(bias.inertia) < inertia
    assert abs(bias.viscous) < viscous
    assert abs(bias.coulomb) < coulomb


@pytest.mark.parametrize("name", ["steering_left", "straight", "rotation", "wheel_lifted"])
def test_torque_and_position_sampled_at_one_sync_fit_without_a_lag(name: str, make_engine: MakeEngine) -> None:
    """A staircase of set-points would put half a cycle between them, 1 % of the viscous friction in driving."""
    bias = drive_and_fit(load_prototype(), name, duration=5.0, sampled=True, make_engine=make_engine)
    assert abs(bias.inertia) < 5e-3
    assert abs(bias.viscous) < 1e-3
    assert abs(bias.coulomb) < 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["steering_left", "straight"])
def test_bias_does_not_hang_on_the_step_size(name: str, engine_name: EngineName) -> None:
    coarse, fine = (
        drive_and_fit(
            load_prototype(),
            name,
            duration=8.0,
            step=step,
            make_engine=with_settings(engine_name, CONVERGED[engine_name]),
        )
        for step in (1e-3, 2.5e-4)
    )
    assert abs(coarse.inertia) < 1e-3
    assert abs(coarse.inertia - fine.inertia) < 1e-3
    assert abs(coarse.viscous - fine.viscous) < 1e-4
    assert abs(coarse.coulomb - fine.coulomb) < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("prototype_name", ["prototype", "compact"])
def test_the_chassis_stands_still_during_a_whole_steering_step(prototype_name: str, make_engine: MakeEngine) -> None:
    for name in ("steering_left", "steering_right"):
        bias = drive_and_fit(load_prototype(prototype_name), name, duration=20.0, make_engine=make_engine)
        assert bias.creep < 1e-5
        assert bias.coupling < 2e-5


def with_settings(engine: EngineName, texts: Sequence[str]) -> MakeEngine:
    """What makes an engine with some of its solver's settings changed."""
    if not texts:
        return ENGINES[engine]
    module = import_module(f"emulator.engine.{engine}.engine")
    plain = module.DEFAULT_SOLVER
    changed = {name: type(getattr(plain, name))(value) for name, value in (text.split("=") for text in texts)}
    make = {EngineName.PYBULLET: "PyBulletEngine", EngineName.MUJOCO: "MuJoCoEngine"}[engine]
    return partial(getattr(module, make), settings=replace(plain, **changed))


def main() -> None:
    """Print the table of biases."""
    parser = argparse.ArgumentParser(description="Bias of the physics engine against the reduced model.")
    parser.add_argument("--duration", type=float, default=20.0, help="of each experiment [s]")
    parser.add_argument("--step", type=float, default=1e-3, help="engine step [s]")
    parser.add_argument("--engine", type=EngineName, default=EngineName.PYBULLET)
    parser.add_argument("--solver", nargs="*", default=[], metavar="NAME=VALUE", help="settings of the engine")
    parser.add_argument("--sampled", action="store_true", help="fit what the bus sees every 2 ms")
    options = parser.parse_args()
    head = ("prototype", "experiment", "inertia %", "viscous %", "coulomb %", "residual", "creep mm", "coupling")
    sys.stdout.write("| " + " | ".join(head) + " |\n" + "|---" * len(head) + "|\n")
    for prototype_name in ("prototype", "compact"):
        for name in BOUNDS:
            bias = drive_and_fit(
                load_prototype(prototype_name),
                name,
                duration=options.duration,
                step=options.step,
                make_engine=with_settings(options.engine, options.solver),
                sampled=options.sampled,
            )
            percent = [f"{100 * value:+.4f}" for value in (bias.inertia, bias.viscous, bias.coulomb)]
            creep = f"{1e3 * bias.creep:.3f}" if name.startswith("steering") else ""
            cells = [prototype_name, name, *percent, f"{bias.residual:.2g}", creep, f"{bias.coupling:.1e}"]
            sys.stdout.write("| " + " | ".join(cells) + " |\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
