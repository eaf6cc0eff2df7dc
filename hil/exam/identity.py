"""Which causes no record of an exam can tell apart: equal columns, by the equations, in the motion that is planned.

Two causes are one where what the parameters of the model leave of their columns is the same; nothing of it comes from
the answers. What is scored of a name or a place depends on whether it can be told from others at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from hil.exam.axes.drawing import MACHINES
from hil.exam.cases import Case, Injected
from hil.exam.folder import ExamFolder, read_exam
from hil.exam.plans import plans_from_text
from ident.campaign.plan import Plan
from ident.campaign.reference import STEERING_LOOPS, sample_times
from ident.diagnosis.observations.directions import VISIBLE
from ident.diagnosis.observations.linear import least_squares, orthonormal
from ident.diagnosis.observations.rows import Column, Rows, make_rows
from ident.diagnosis.problem import Candidate, Problem, Series
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.causes.library import DRIFTS, POSITIVE
from ident.diagnosis.vehicle.experiment.advice import Driven, hidden_effects
from ident.diagnosis.vehicle.experiment.visibility import RANK, Visibility, row_noise
from ident.effects import EFFECTS
from ident.parameters_file import read_model
from ident.records.record import Record, Segment, make_segment
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

IDENTICAL: Final = 0.999
"""Cosine of the angle between what two causes leave, from which no record tells them apart: rank, up to rounding.

In the four steps, causes are either identical to seven digits or below 0.97.
"""

SIZED: Final = 1e-3
"""Part of a column that the size of the effect must have; the rest is another of its numbers."""


@dataclass(frozen=True)
class Identity:
    """What one effect cannot be told from.

    Attributes:
        names: of effects that look the same at some place, its own among them.
        places: at which an effect of its name looks the same, its own among them.
    """

    names: frozenset[str]
    places: frozenset[str]


class Identities:
    """Identities by key of a cause and sign of its size."""

    def __init__(self, alike: Mapping[tuple[str, bool], Sequence[str]], hidden: Collection[str] = ()) -> None:
        """What looks the same.

        Args:
            alike: keys that look the same, by key of the cause and whether its size is positive.
            hidden: names of effects that these steps cannot show beside the parameters: all that they do, changed
                values of the model do as well.
        """
        self._alike = alike
        self._hidden = frozenset(hidden)

    def of(self, effect: Injected) -> Identity:
        """Identity of an effect; its own name and place alone where the library has no candidate for it."""
        key = f"{effect.name}@{effect.where}"
        pairs = [other.split("@") for other in self._alike.get((key, effect.size > 0), ())]
        names = frozenset(name for name, _ in pairs)
        if effect.name in self._hidden:
            names |= frozenset(map(str, DRIFTS))
        return Identity(
            names | {effect.name},
            frozenset(where for name, where in pairs if name == effect.name) | {effect.where},
        )

    def of_case(self, case: Case) -> tuple[Identity, ...]:
        """Of every effect of a case."""
        return tuple(self.of(effect) for effect in case.effects)


def exam_identities(folder: ExamFolder) -> tuple[Identities, ...]:
    """Identities by `Case.excitation` of an exam, from its plans, its vehicle and its model."""
    exam = read_exam(folder)
    if exam.of_axes:
        # What is drawn for them is all of one place, and of names that a motion at many speeds tells apart.
        return (Identities({}),) * MACHINES
    vehicle, model = load_vehicle(folder.vehicle), read_model(folder.model)
    found = []
    for text in exam.plans:
        plans = plans_from_text(text, vehicle, exam.cycle)
        records = [planned_record(plan, model.parameters) for plan in (plans.fit, plans.confirm)]
        problem = build_problem(records, vehicle, model.parameters, lag=model.lag, given=model.effects)
        found.append(identities(problem, vehicle))
    return tuple(found)


def planned_record(plan: Plan, parameters: Parameters) -> Record:
    """One repeat of every step of a plan, driven exactly by a vehicle that obeys the model."""
    once = replace(plan, periods=1)
    segments = []
    for step in plan.steps:
        reference = once.reference(step, parameters)
        rates = np.sum([track.velocity[:, None] * track.wheels for track in reference.tracks.values()], axis=0)
        segment = Segment(
            step=reference.step,
            sample_time=plan.cycle,
            time=sample_times(len(reference), plan.cycle),
            motor_torques=reference.feed_forward,
            wheel_angles=cumulative_trapezoid(rates, dx=plan.cycle, axis=0, initial=0.0),
            steering_angles=np.stack([reference.tracks[name].position for name in STEERING_LOOPS], axis=1),
            period=reference.period,
        )
        segments.append(make_segment(segment, "planned"))
    return Record(segments, "planned")


def identities(problem: Problem, vehicle: VehicleDescription) -> Identities:
    """Identities of all causes that a problem shows.

    Structure is compared beside the parameters, which are free there; changed parameters as they are.
    """
    rows = make_rows(problem)
    scale = row_noise(rows)[:, None]
    baseline = orthonormal(rows.baseline / scale, RANK)

    def beside(columns: Array) -> Array:
        return np.asarray(columns - baseline @ (baseline.T @ columns))

    groups: Mapping[bool, list[_Cause]] = {
        drift: [
            cause
            for number, candidate in enumerate(problem.candidates)
            if (candidate.effect in DRIFTS) == drift
            and (cause := _cause(_forms(problem, rows, number, scale), np.asarray if drift else beside)) is not None
        ]
        for drift in (False, True)
    }
    return Identities(
        {
            (cause.key, positive): [
                other.key for other in group if other is not cause and other.imitates(cause.signal, positive)
            ]
            for group in groups.values()
            for cause in group
            for positive in (True, False)
        },
        hidden_effects(Driven(dict.fromkeys((block.step for block in problem.blocks), (0.0,))), Visibility(vehicle)),
    )


@dataclass(frozen=True)
class _Cause:
    """What the rows show of a cause.

    Attributes:
        key, one_sided: which, and whether its size is never negative.
        signal: (n,) of unit size, its other numbers as the exam injects them.
        spaces: (n, k) columns of its variants, the size first.
    """

    key: str
    one_sided: bool
    signal: Array
    spaces: tuple[Array, ...]

    def imitates(self, signal: Array, positive: bool) -> bool:
        """Whether some of its sizes leave the same as a signal, or as its negative."""
        wanted = signal if positive else -signal
        return any(self._matches(space, wanted) for space in self.spaces)

    def _matches(self, space: Array, wanted: Array) -> bool:
        values = least_squares(space, wanted)
        length = float(np.linalg.norm(wanted))
        if self.one_sided and values[0] * float(np.linalg.norm(space[:, 0])) < SIZED * length:
            return False
        return float(np.linalg.norm(wanted - space @ values)) < math.sqrt(1 - IDENTICAL**2) * length


@dataclass(frozen=True)
class _Forms:
    """What a cause may look like, over the noise of the rows.

    Attributes:
        candidate: the cause.
        spaces: (n, k) columns of its variants, the size first.
        signal: (n, 1) of unit size, its other numbers as the exam injects them; None: it has no such form.
    """

    candidate: Candidate
    spaces: tuple[Array, ...]
    signal: Array | None


def _forms(problem: Problem, rows: Rows, number: int, scale: Array) -> _Forms:
    candidate = problem.candidates[number]
    # What comes along with an effect, and shows by itself, is no form of that effect.
    own = [column for column in rows.layout if column.candidate == number and column.width > 0 and column.itself]
    spaces = [rows.columns[:, column.place] / scale for column in own]
    tried = next((space for space, column in zip(spaces, own, strict=True) if _is_injected(candidate, column)), None)
    if tried is not None:
        return _Forms(candidate, tuple(spaces), tried[:, :1])
    exact = _as_injected(candidate, problem) if spaces else None
    if exact is None:
        return _Forms(candidate, tuple(spaces), None)
    signal = rows.stack(exact)[:, None] / scale
    return _Forms(candidate, (*spaces, signal), signal)


def _cause(forms: _Forms, compared: Callable[[Array], Array]) -> _Cause | None:
    """None where nothing is to be seen of it; `compared` is what is looked at of columns (n, k)."""
    if forms.signal is None:
        return None
    signal = compared(forms.signal)[:, 0]
    if np.linalg.norm(signal) <= VISIBLE * np.linalg.norm(forms.signal):
        return None
    spaces = tuple(compared(space) for space in forms.spaces)
    return _Cause(forms.candidate.key, forms.candidate.effect in POSITIVE, signal, spaces)


def _as_injected(candidate: Candidate, problem: Problem) -> Series | None:
    """What an effect of unit size, as it grows with that, adds to every block, its other numbers at their defaults.

    None where it has no exact form, or a number that has no default.
    """
    others = [parameter.default for parameter in EFFECTS[candidate.effect].parameters[1:]]
    if candidate.contribution is None or problem.nominal is None or None in others:
        return None
    return candidate.contribution(np.array([1.0, *others], dtype=float), problem.nominal.values)


def _is_injected(candidate: Candidate, column: Column) -> bool:
    """Whether a variant's other numbers are those that an effect of an exam has: the defaults."""
    start = candidate.variants[column.variant].start
    if start is None:
        return True
    values = start(np.eye(column.width)[0])
    defaults = [parameter.default for parameter in EFFECTS[candidate.effect].parameters]
    return all(
        default is None or bool(np.isclose(value, default)) for default, value in zip(defaults, values, strict=True)
    )
