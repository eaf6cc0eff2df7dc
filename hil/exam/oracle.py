"""What somebody would find who knows which cause to look for, and where: the most that can be asked of a diagnosis.

The evidence of the true candidate alone is gathered for every case with one effect, and that of the same candidates for
every case without any. How large the latter are by chance says from where on a candidate counts as found, at whatever
rate of false alarms. Of axes and of vehicles alike; nothing is searched, nothing else is believed to be there.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence

import numpy as np

from hil.exam.cases import SIZES, Case, Kind
from hil.exam.diagnosing import (
    Progress,
    axis_records,
    both_records,
    described,
    descriptions,
    forbid_emulator,
    keep_answers,
    refuse_undiagnosed,
    vehicle_records,
    with_records,
)
from hil.exam.folder import ExamFolder, read_exam
from hil.exam.statistics import Rate, rate
from ident.diagnosis.axis.diagnose import pose_axis
from ident.diagnosis.axis.reference import axis_reference
from ident.diagnosis.problem import Problem
from ident.diagnosis.search.known import NOTHING, log_evidence_of
from ident.diagnosis.vehicle.diagnose import pose_vehicle
from ident.errors import UserError


def asked_of_oracle(cases: Sequence[Case]) -> dict[str, tuple[str, ...]]:
    """Candidates that the oracle looks for, by case: the true one, or where there is none each of those."""
    single = {case.identifier: (_key(case),) for case in cases if case.kind is Kind.EFFECT}
    known = tuple(sorted({key for (key,) in single.values()}))
    return single | {case.identifier: known for case in cases if case.kind is Kind.NONE}


def ask_oracle(
    folder: ExamFolder,
    asked: Mapping[str, Sequence[str]],
    *,
    jobs: int,
    scheduler: str | None,
    progress: Progress,
) -> None:
    """Gather the evidence of known candidates, of all cases that have records and no such answer yet.

    Args:
        folder: of the exam.
        asked: candidates by case.
        jobs: processes on this machine.
        scheduler: of a Dask cluster, None for this machine.
        progress: called with cases done and in all.

    Raises:
        UserError: there is no exam, it has no records yet, or cases of a sealed one have not been diagnosed.
    """
    forbid_emulator()
    exam = read_exam(folder)
    there = with_records(folder, exam.identifiers)
    if exam.sealed:
        refuse_undiagnosed(folder, there)
    texts = None if exam.of_axes else descriptions(folder)

    def task(identifier: str) -> tuple[object, ...]:
        return identifier, *both_records(folder, identifier), texts, tuple(asked[identifier])

    places = {identifier: folder.oracle(identifier) for identifier in there if identifier in asked}
    keep_answers(evidence_of_case, task, places, jobs=jobs, scheduler=scheduler, progress=progress)


def evidence_of_case(
    identifier: str, fit: bytes, confirm: bytes, texts: tuple[str, str] | None, keys: Sequence[str]
) -> tuple[str, bytes]:
    """Log evidence of known candidates by key, as JSON, null for none; runs in a worker.

    Args:
        identifier: of the case.
        fit, confirm: its records, as Parquet.
        texts: of the files of vehicle and model; None: an axis.
        keys: of the candidates.
    """
    forbid_emulator()
    try:
        found = log_evidence_of(*posed(fit, confirm, texts), keys)
    except (ArithmeticError, ValueError, UserError):
        # A record that the diagnosis refuses shows an oracle nothing either.
        found = dict.fromkeys(keys, NOTHING)
    return identifier, json.dumps({key: value if np.isfinite(value) else None for key, value in found.items()}).encode()


def posed(fit: bytes, confirm: bytes, texts: tuple[str, str] | None) -> tuple[Problem, Problem]:
    """What is asked of a case, of its records to fit and to confirm, as Parquet.

    Args:
        fit, confirm: the records.
        texts: of the files of vehicle and model; None: an axis.

    Raises:
        UserError: nothing can be asked of these records.
    """
    if texts is None:
        axes = axis_records(fit, confirm)
        return pose_axis(axes[:1], axes[1:], axis_reference(axes[:1], None, axes[1:]))
    records = vehicle_records(fit, confirm)
    return pose_vehicle(records[:1], records[1:], *described(*texts)).problems


def oracle_rates(folder: ExamFolder, cases: Sequence[Case], false_alarms: float) -> dict[float, Rate]:
    """What the oracle finds, by size in noise units; empty where it was not asked.

    Args:
        folder: of the exam.
        cases: from its answer.
        false_alarms: rate at which candidates of cases without any effect shall count as found.
    """
    said = {
        case.identifier: json.loads(path.read_text(encoding="utf-8"))
        for case in cases
        if (path := folder.oracle(case.identifier)).is_file()
    }
    chance = [value for case in cases if case.kind is Kind.NONE for value in _values(said.get(case.identifier, {}))]
    if not chance:
        return {}
    least = max(float(np.quantile(chance, 1 - false_alarms)), 0.0)
    asked = [case for case in cases if case.kind is Kind.EFFECT and case.identifier in said]
    return {
        size: rate([_values(said[case.identifier])[0] > least for case in asked if case.noise_units == size])
        for size in SIZES
    }


def _values(said: Mapping[str, float | None]) -> list[float]:
    """Log evidence; of what is invisible the least there is."""
    return [-sys.float_info.max if value is None else value for value in said.values()]


def _key(case: Case) -> str:
    (effect,) = case.effects
    return f"{effect.name}@{effect.where}"
