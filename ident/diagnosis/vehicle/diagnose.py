"""The diagnosis of the platform from its records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from threadpoolctl import threadpool_limits

from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.answer.judge import judge
from ident.diagnosis.diagnosis import Diagnosis
from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.split import split_problem
from ident.diagnosis.problem import Problem
from ident.diagnosis.vehicle.build import build_problem
from ident.diagnosis.vehicle.causes.belonging import refuse_other_vehicle
from ident.diagnosis.vehicle.experiment.advice import Driven, driven_steps, hidden_effects, next_experiment
from ident.diagnosis.vehicle.experiment.visibility import Visibility
from ident.effects.extended import ExtendedModel
from ident.errors import DataFileError, RecordError
from ident.records.record import Record
from ident.stages import Stage, untold
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

UNSTATED_STD: Final = 1e-3
"""Standard deviation of a model's value that comes without one, relative to the value."""


@dataclass(frozen=True)
class VehicleDiagnosis:
    """What was found, and what to drive next.

    Attributes:
        findings: everything that reports show.
        next_experiment: for people; None where nothing would tell more.
        problems: to fit and to confirm, with all candidates, changed parameters included.
    """

    findings: Findings
    next_experiment: str | None
    problems: tuple[Problem, Problem]

    @property
    def diagnosis(self) -> Diagnosis:
        """The answer as it is written down."""
        return self.findings.diagnosis(self.next_experiment)


def diagnose_vehicle(
    fit: Sequence[Record],
    confirm: Sequence[Record],
    vehicle: VehicleDescription,
    model: ExtendedModel | Parameters | None = None,
    *,
    seed: int = 1,
    effects: Sequence[EffectName] = tuple(EffectName),
    stage: Stage = untold,
) -> VehicleDiagnosis:
    """What the model of the platform lacks.

    Args:
        fit: records that causes are looked for in.
        confirm: independent records; none: a part of `fit` confirms.
        vehicle: its geometry is taken as true.
        model: being judged, with the effects that it has; None: parameters are refitted, only structure can be missing.
        seed: of the smooth function of what is left.
        effects: that are looked for.
        stage: told what begins.

    Raises:
        RecordError: a record is of another vehicle, does not move, has no torques or holds none of the steps of a
            diagnosis, or the confirming records hold none of those fitted.
        DataFileError: a parameter of the model is zero.
    """
    # Tall, thin matrices: more threads of the linear algebra library only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        stage("rows of the records")
        question = pose_vehicle(fit, confirm, vehicle, model, effects)
        findings = judge(*question.problems, seed=seed, stage=stage)
        invisible = tuple(str(name) for name in effects if name in question.hidden or name in findings.invisible)
        findings = replace(findings, invisible=invisible)
        stage("the next experiment")
        steps = {block.step for block in question.problems[0].blocks}
        advice = next_experiment(findings, question.driven.only(steps), question.visibility)
        return VehicleDiagnosis(findings, advice, question.problems)


@dataclass(frozen=True)
class Question:
    """What is asked of the records.

    Attributes:
        problems: to fit and to confirm, with all candidates.
        driven: steps of the records to fit.
        visibility: of every effect in every step.
        hidden: effects that these steps do not show.
    """

    problems: tuple[Problem, Problem]
    driven: Driven
    visibility: Visibility
    hidden: frozenset[EffectName]


def pose_vehicle(
    fit: Sequence[Record],
    confirm: Sequence[Record],
    vehicle: VehicleDescription,
    model: ExtendedModel | Parameters | None = None,
    effects: Sequence[EffectName] = tuple(EffectName),
) -> Question:
    """The rows of the records and the candidates, before anything is looked for; arguments of `diagnose_vehicle`."""
    if isinstance(model, Parameters):
        model = ExtendedModel(model)
    if model is not None:
        _refuse_zero(model.parameters)
    refuse_other_vehicle((*fit, *confirm), vehicle.geometry)
    _refuse_silent((*fit, *confirm))
    driven = driven_steps(fit, vehicle.prior["m_ch"], model.effects if model else ())
    visibility = Visibility(vehicle)
    hidden = hidden_effects(driven, visibility)
    shown = [name for name in effects if name not in hidden]
    fitted = _problem(fit, vehicle, model, shown)
    if not confirm:
        return Question(split_problem(fitted), driven, visibility, hidden)
    confirming = _problem(confirm, vehicle, model, shown)
    _refuse_strangers(fitted, confirming)
    return Question((fitted, confirming), driven, visibility, hidden)


def _problem(
    records: Sequence[Record], vehicle: VehicleDescription, model: ExtendedModel | None, effects: Sequence[EffectName]
) -> Problem:
    if model is None:
        return build_problem(records, vehicle, effects=effects)
    problem = build_problem(records, vehicle, model.parameters, lag=model.lag, given=model.effects, effects=effects)
    assert problem.nominal is not None
    stated = problem.nominal.std
    std = np.where(stated > 0, stated, UNSTATED_STD * np.abs(problem.nominal.values))
    return replace(problem, nominal=replace(problem.nominal, std=std))


def _refuse_zero(parameters: Parameters) -> None:
    for name, value in zip(PARAMETER_NAMES, parameters.values.tolist(), strict=True):
        if value == 0:
            raise DataFileError(
                f"{name} of the model is zero: a change of it, stated relative to it, would have no size.",
                "Give the least value that makes sense, with its std, or leave --model out to have all refitted.",
            )


def _refuse_silent(records: Sequence[Record]) -> None:
    for record in records:
        if not any(np.ptp(segment.motor_torques, axis=0).any() for segment in record.segments):
            raise RecordError(f"{record.source}: no motor torque ever changes.", "Record the torques of the drives.")


def _refuse_strangers(fitted: Problem, confirming: Problem) -> None:
    labels, others = ({block.label for block in problem.blocks} for problem in (fitted, confirming))
    if not labels & others:
        raise RecordError(
            f"The records to confirm hold none of the steps fitted ({', '.join(sorted(labels))}).",
            "Confirm on another drive of the same steps.",
        )
