"""The outcome channel: the model simulated forward with the recorded torques, set back to the recorded state often.

What is compared is what encoders read: on motors behind gears that give way, on wheels of a radius of their own. Only
a steering encoder that is late or misadjusted is put right in the record.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.records.inputs import SLICES, copied
from ident.diagnosis.vehicle.records.signals import shifted
from ident.diagnosis.vehicle.records.sources import Source
from ident.effects import make_effect
from ident.effects.extended import ExtendedModel, simulation_of
from ident.plant import kinematics
from ident.plant.bristles import all_bent_along
from ident.plant.kinematics import GENERALIZED_VELOCITIES
from ident.plant.modes import Mode
from ident.plant.simulation import Motion, Readings
from ident.vehicle.geometry import Geometry

Array = NDArray[np.float64]

HORIZON: Final = 0.4
"""Time that the simulation runs before it is set back to what was recorded [s]."""


@dataclass(frozen=True)
class Outcome:
    """Simulated minus recorded velocity of one coordinate of one segment.

    Attributes:
        step, coordinate: which.
        differences: (W, T) of W runs [m/s or rad/s].
        repeat: (W,) number of the repeat of the excitation, -1 outside of any.
        place: (W,) number of the run within its repeat.
    """

    step: str
    coordinate: str
    differences: Array
    repeat: NDArray[np.int64]
    place: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Runs:
    """Runs of one segment.

    Attributes:
        source: the segment.
        inputs: (W, T, INPUTS) recorded, encoders put right.
        bent: (W, m) how far the bristles of the model are bent at the start of each.
        repeat, place: (W,) as of an outcome.
    """

    source: Source
    inputs: Array
    bent: Array
    repeat: NDArray[np.int64]
    place: NDArray[np.int64]

    @property
    def simulated_with(self) -> tuple[Mode, float, float]:
        """Mode, sample time [s] and known load [kg]: runs that have these in common are simulated at once."""
        assert self.source.spec.mode is not None
        return self.source.spec.mode, self.source.sample_time, float(self.source.inputs[0, SLICES["payload"].start])


def outcomes(sources: Iterable[Source], model: ExtendedModel, geometry: Geometry) -> list[Outcome]:
    """SEVEN of the coordinates that segments move; none for wheels in the air, or where nothing moves long."""
    groups: dict[tuple[Mode, float, float], list[_Runs]] = {}
    for source in sources:
        runs = _runs(source, model)
        if runs is not None:
            groups.setdefault(runs.simulated_with, []).append(runs)
    return [outcome for key, runs in groups.items() for outcome in _simulated(runs, *key, model, geometry)]


def _runs(source: Source, model: ExtendedModel) -> _Runs | None:
    if source.channel is not Channel.DYNAMIC or source.spec.mode is None:
        return None
    length = round(HORIZON / source.sample_time) + 1
    starts, repeat, place = _starts(source, length)
    if not len(starts):
        return None
    whole = without_encoder_errors(source.inputs, model, source.sample_time)
    angles = np.hstack([whole[:, SLICES[name]] for name in ("alpha", "beta")])
    bent = all_bent_along(model.terms, angles)[starts]
    return _Runs(source, whole[starts[:, None] + np.arange(length)], bent, repeat, place)


def _simulated(
    group: Sequence[_Runs], mode: Mode, sample_time: float, load: float, model: ExtendedModel, geometry: Geometry
) -> Iterable[Outcome]:
    inputs = np.concatenate([runs.inputs for runs in group])
    read = Readings(inputs[..., SLICES["alpha_rate"]], inputs[..., SLICES["beta_rate"]])
    recorded = _velocities(mode, inputs, read, geometry)
    start = Motion(
        inputs[:, 0, SLICES["heading"].start],
        inputs[:, 0, SLICES["alpha"]],
        inputs[:, 0, SLICES["beta"]],
        recorded[:, 0],
        np.concatenate([runs.bent for runs in group]),
    )
    simulation = simulation_of(_loaded(model, load), mode, geometry)
    run = simulation.run_from_readings(start, read, inputs[:, :, SLICES["torques"]], sample_time)
    differences = (_velocities(mode, inputs, run.readings, geometry) - recorded)[:, 1:]
    names = GENERALIZED_VELOCITIES[mode]
    borders = np.cumsum([len(runs.inputs) for runs in group])[:-1]
    for runs, own in zip(group, np.split(differences, borders), strict=True):
        for name in runs.source.spec.coordinates:
            yield Outcome(runs.source.step, name, own[..., names.index(name)], runs.repeat, runs.place)


def _loaded(model: ExtendedModel, mass: float) -> ExtendedModel:
    """The model with a known load [kg] aboard."""
    load = make_effect(EffectName.PAYLOAD, "chassis", {"mass": mass, "inertia": 0.0})
    return replace(model, effects=(*model.effects, load)) if mass else model


def _starts(source: Source, length: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """First samples of runs in which everything moves throughout, with their repeat and place in it."""
    moving, found = np.all(source.moving, axis=0), []
    for number in np.unique(source.period):
        samples = np.flatnonzero(source.period == number)
        for place, first in enumerate(range(int(samples[0]), int(samples[-1]) + 2 - length, length)):
            window = slice(first, first + length)
            if moving[window].all() and (source.period[window] == number).all():
                found.append((first, int(number), place))
    table = np.array(found, dtype=np.int64).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def without_encoder_errors(inputs: Array, model: ExtendedModel, sample_time: float) -> Array:
    """Inputs (N, INPUTS) with the true steering angles in place of those that late or misadjusted encoders report."""
    true = copied(inputs)
    for side, (delay, offset) in enumerate(zip(model.encoder_delays(), model.encoder_offsets(), strict=True)):
        for name in ("alpha", "alpha_rate", "alpha_acceleration"):
            column = SLICES[name].start + side
            true[:, column] = shifted(inputs[:, column], -float(delay), sample_time)
        true[:, SLICES["alpha"].start + side] -= offset
    return true


def _velocities(mode: Mode, inputs: Array, read: Readings, geometry: Geometry) -> Array:
    """ṡ_k (W, T, n_k) that rates of the joints, as their encoders read them, stand for at the recorded angles."""
    H = kinematics.complement(mode, inputs.reshape(-1, inputs.shape[-1])[:, SLICES["alpha"]], geometry)[:, 3:]
    rates = np.concatenate([read.steering_rates, read.wheel_rates], axis=-1).reshape(-1, H.shape[1])
    solved = np.einsum("nij,nj->ni", np.linalg.pinv(H), rates)
    return np.asarray(solved.reshape(*inputs.shape[:2], -1))
