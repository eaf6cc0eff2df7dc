"""A model of the platform with effects: parameters and `[[effects]]` of one file, and the torques that they ask for."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.vehicle import symbolic
from ident.vehicle.effect_terms import (
    TERMS,
    EffectTerm,
    State,
    added_forces,
    changed_parameters,
    on_radii,
    rolling_radii,
    shaft_torques,
    term_of,
)
from ident.vehicle.effect_text import effects_text, read_effects
from ident.vehicle.effects import DRIVES, Effect, EffectName
from ident.vehicle.geometry import Geometry
from ident.vehicle.kinematics import GENERALIZED_VELOCITIES
from ident.vehicle.modes import Mode
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES, PARAMETER_UNITS, Parameters, read_parameters
from ident.vehicle.quantities import read_toml
from ident.vehicle.symbolic import Expression
from ident.vehicle.vectorised import Vectorised

Array = NDArray[np.float64]

SCHEMA: Final = "quasiomni.parameters/1"


@dataclass(frozen=True)
class ExtendedModel:
    """Parameters (18) and the effects beside them.

    Attributes:
        parameters: p, refitted with the effects in place.
        effects: none for the plain model.
    """

    parameters: Parameters
    effects: tuple[Effect, ...] = ()

    @property
    def terms(self) -> list[EffectTerm]:
        """The effects that are terms of the equations."""
        return [term_of(effect) for effect in self.effects if effect.name in TERMS]

    def delays(self) -> Array:
        """Dead times (4,) of the drives [s]."""
        delays = np.zeros(4)
        for effect in self.effects:
            if effect.name is EffectName.TIME_DELAY and effect.where in DRIVES:
                delays[DRIVES.index(effect.where)] += effect.size
        return delays


def read_model(path: Path) -> ExtendedModel:
    """The model of a `parameters.toml`, effects included.

    Raises:
        DataFileError: the file cannot be used; says where.
    """
    return ExtendedModel(read_parameters(path), read_effects(read_toml(path), str(path)))


def model_text(model: ExtendedModel, provenance: Mapping[str, str]) -> str:
    """A `parameters.toml`; `provenance` says where the values come from."""
    source = json.dumps(provenance.get("run", "record"))
    lines = [f'schema = "{SCHEMA}"', "", "[source]"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in provenance.items()]
    for name, value, std in zip(PARAMETER_NAMES, model.parameters.values, model.parameters.std, strict=True):
        entry = [f"value = {value:.9g}", f'unit = "{PARAMETER_UNITS[name]}"', f"std = {std:.6g}", f"source = {source}"]
        lines += ["", f"[parameters.{name}]", *entry]
    return "\n".join(lines) + "\n" + effects_text(model.effects)


def write_model(model: ExtendedModel, path: Path, provenance: Mapping[str, str]) -> None:
    """Write the file whole or not at all."""
    temporary = path.with_suffix(".tmp")
    temporary.write_text(model_text(model, provenance), encoding="utf-8")
    temporary.replace(path)


@dataclass(frozen=True)
class Course:
    """A motion in one mode.

    Attributes:
        mode: k.
        heading: (N,) [rad].
        alpha: (N, 2) [rad].
        beta: (N, 4) [rad].
        velocities, accelerations: ṡ_k, s̈_k (N, n_k).
    """

    mode: Mode
    heading: Array
    alpha: Array
    beta: Array
    velocities: Array
    accelerations: Array


def feed_forward(model: ExtendedModel, course: Course, plain: Array, geometry: Geometry, sample_time: float) -> Array:
    """Motor torques (N, 4) [Nm] for a motion of a vehicle with effects.

    What the effects ask for at a wheel or a steering side is given there, the rest by the pseudoinverse as in (21);
    drives that are late are asked earlier.

    Args:
        model: with its effects.
        course: desired motion.
        plain: torques (N, 4) that the plain model with the same parameters gives, however distributed.
        geometry: of the vehicle.
        sample_time: of the course [s].
    """
    function = _torques_function(course.mode, model.terms)
    torques = function(
        course.heading[:, None],
        course.alpha,
        course.beta,
        course.velocities,
        course.accelerations,
        plain,
        model.parameters.values,
        geometry.as_vector(),
        np.array([COULOMB_EPSILON]),
    )[..., 0]
    return _earlier(torques, model.delays(), sample_time)


def _torques_function(mode: Mode, terms: Sequence[EffectTerm]) -> Vectorised:
    width = len(GENERALIZED_VELOCITIES[mode])
    heading, alpha, beta, plain = (ca.SX.sym(name, size) for name, size in (("γ", 1), ("α", 2), ("β", 4), ("u", 4)))
    velocity, acceleration = ca.SX.sym("v", width), ca.SX.sym("a", width)
    p = ca.SX.sym("p", len(PARAMETER_NAMES))
    H = on_radii(symbolic.complement(mode, alpha), rolling_radii(terms, beta))
    rates = H @ velocity
    accelerations = ca.jtimes(rates, alpha, rates[3:5]) + ca.jtimes(rates, beta, rates[5:]) + H @ acceleration
    state = State(heading, alpha, beta, rates, accelerations)
    forces = added_forces(terms, state, p)
    wanted = H.T @ (symbolic.regressor(rates, accelerations) @ changed_parameters(terms, p) + forces)
    driven = H.T @ symbolic.input_matrix()
    local = plain + _at_its_place(forces)
    torques = local + driven.T @ ca.solve(driven @ driven.T, wanted - driven @ local)
    inputs = [heading, alpha, beta, velocity, acceleration, plain, p, symbolic.GEOMETRY, symbolic.EPSILON]
    return Vectorised(ca.Function("torques", inputs, [ca.cse(ca.densify(_asked(terms, torques, beta)))]))


def _at_its_place(forces: Expression) -> Expression:
    """Motor torques (4,) against friction of wheels and steering sides, each by the wheels concerned."""
    lengths = symbolic.LENGTHS
    left, right = (forces[row] * lengths.r / (2 * lengths.a * lengths.i_G) for row in (3, 4))
    return forces[5:] / lengths.i_G + ca.vertcat(-left, left, right, -right)


def _asked(terms: Sequence[EffectTerm], torques: Expression, beta: Expression) -> Expression:
    """Torques that the drives must believe to give for these to act at their shafts: `shaft_torques` backwards."""
    reported = ca.SX.sym("reported", 4)
    true = shaft_torques(terms, reported, beta)
    offset = ca.substitute(true, reported, ca.SX.zeros(4))
    return ca.solve(ca.jacobian(true, reported), torques - offset)


def _earlier(torques: Array, delays: Array, sample_time: float) -> Array:
    time = np.arange(len(torques)) * sample_time
    moved = [np.interp(time + delay, time, column) for column, delay in zip(torques.T, delays, strict=True)]
    return np.stack(moved, axis=1)
