"""The sealing side: draws the cases, runs the emulator over CAN, writes records and a sealed answer."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from emulator.effects.injection import AnyEffect
from emulator.effects.unlibraried import UNLIBRARIED, Unlibraried, UnlibrariedName
from hil.campaign.folder import network_file_of
from hil.exam.cases import Case, Composition, Injected, draw_cases
from hil.exam.driving import drive
from hil.exam.folder import (
    RECORDS,
    Exam,
    ExamFolder,
    answer_hash,
    open_answer,
    read_exam,
    sealed,
    write_exam,
)
from hil.exam.plans import ExamPlans, plan_exam, plans_from_text, plans_text
from hil.exam.record_bytes import record_bytes
from hil.exam.sizes import SizeTable
from hil.exam.workers import run_all
from hil.network import load_network
from ident.errors import UserError
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.effects import EffectName, make_effect
from ident.writing import write_whole

Progress = Callable[[int, int], None]
"""Called with cases done and cases in all."""

MODEL_FILE: Final = Path(__file__).parent / "data" / "model.toml"
"""The model that is judged, as identified from a campaign of the prototype without effects: `quasiomni campaign
--seed 400001 --periods 8 --skip lane_change`, then `quasiomni identify`."""

_EPOCH: Final = (0, 0)


@dataclass(frozen=True)
class SealingOrder:
    """An exam as it is asked for.

    Attributes:
        out: folder.
        prototype: of the emulator, by name.
        composition: how many cases of each kind.
        seed: first of the noise, two a case; of the excitations, one each; and of everything drawn.
        jobs: processes on this machine.
        scheduler: of a Dask cluster, None for this machine.
    """

    out: Path
    prototype: str
    composition: Composition
    seed: int
    jobs: int
    scheduler: str | None


def seal(order: SealingOrder, table: SizeTable, progress: Progress) -> Exam:
    """Seal an exam, or go on with one that was stopped.

    A case whose effects stop the campaign has no records: what was wrong is sealed with the answer.

    Raises:
        UserError: no case is asked for, or the folder holds another exam.
    """
    if not order.composition.total:
        raise UserError("An exam without cases is none.", "Ask for some: --effects, --none, --unknown.")
    folder = ExamFolder(order.out)
    # The excitations take minutes before the first case is done.
    progress(0, order.composition.total)
    if not folder.manifest.is_file():
        _draw(folder, order, table)
    exam = read_exam(folder)
    cases = open_answer(folder, exam.answer_hash)
    _refuse_other(cases, exam, order)
    left = [case for case in cases if not _finished(folder, case.identifier)]
    tasks = [(exam.plans[case.excitation], exam.prototype, exam.cycle, case) for case in left]
    done = len(cases) - len(left)
    progress(done, len(cases))
    for identifier, contents in run_all(drive_case, tasks, jobs=order.jobs, scheduler=order.scheduler):
        if isinstance(contents, str):
            write_whole(contents, folder.undriven(identifier))
        else:
            _write_records(folder, identifier, contents)
        done += 1
        progress(done, len(cases))
    return exam


def _write_records(folder: ExamFolder, identifier: str, contents: tuple[bytes, bytes]) -> None:
    for which, content in zip(RECORDS, contents, strict=True):
        path = folder.record(identifier, which)
        write_whole(content, path)
        os.utime(path, _EPOCH)


def drive_case(plans: str, prototype: str, cycle: float, case: Case) -> tuple[str, tuple[bytes, bytes] | str]:
    """Both records of a case, or why the vehicle cannot be driven with its effects; runs in a worker."""
    both = _plans(plans, prototype, cycle)
    effects = [effect_of(injected) for injected in case.effects]
    try:
        fit = drive(both.fit, prototype, case.seed, effects)
        confirm = drive(both.confirm, prototype, case.seed + 1, effects)
    except UserError as error:
        return case.identifier, f"{error.what} {error.remedy}\n"
    return case.identifier, (record_bytes(fit), record_bytes(confirm))


def effect_of(injected: Injected) -> AnyEffect:
    """What the emulator injects."""
    if injected.name in UnlibrariedName.__members__.values():
        return Unlibraried(UnlibrariedName(injected.name), injected.where, injected.size)
    return make_effect(EffectName(injected.name), injected.where, {injected.parameter: injected.size})


def unlibraried_unit(name: str) -> str:
    """Unit of the size of an effect without a candidate."""
    return UNLIBRARIED[UnlibrariedName(name)].unit


@lru_cache(maxsize=Composition.excitations)
def _plans(text: str, prototype: str, cycle: float) -> ExamPlans:
    return plans_from_text(text, load_vehicle(prototype), cycle)


def _draw(folder: ExamFolder, order: SealingOrder, table: SizeTable) -> None:
    """Everything but the records."""
    cycle = load_network(network_file_of(order.prototype)).cycle_period
    cases = draw_cases(table, order.composition, order.seed, np.random.default_rng(order.seed))
    plans = _draw_plans(order, cycle)
    answer = sealed(cases, secrets.token_bytes(16))
    write_whole(answer, folder.answer)
    shutil.copyfile(find_data_file("ident.vehicle", order.prototype), folder.vehicle)
    shutil.copyfile(MODEL_FILE, folder.model)
    identifiers = tuple(case.identifier for case in cases)
    write_exam(folder, Exam(order.prototype, cycle, plans, identifiers, answer_hash(answer)))


def _draw_plans(order: SealingOrder, cycle: float) -> tuple[str, ...]:
    tasks = [(number, order.prototype, order.seed + number, cycle) for number in range(order.composition.driven)]
    return tuple(text for _, text in sorted(run_all(draw_plans, tasks, jobs=order.jobs, scheduler=order.scheduler)))


def draw_plans(number: int, prototype: str, seed: int, cycle: float) -> tuple[int, str]:
    """A pair of campaigns under its number; runs in a worker."""
    return number, plans_text(plan_exam(load_vehicle(prototype), seed, cycle))


def _refuse_other(cases: list[Case], exam: Exam, order: SealingOrder) -> None:
    first = min(case.seed for case in cases)
    held = (exam.prototype, len(cases), len(exam.plans), first)
    if held != (order.prototype, order.composition.total, order.composition.driven, order.seed):
        raise UserError(
            f"{order.out} holds another exam: {len(cases)} cases of {exam.prototype} on {len(exam.plans)} "
            f"excitations from seed {first}.",
            "Go on with it as it was begun, or name another folder (--out).",
        )


def _finished(folder: ExamFolder, identifier: str) -> bool:
    return folder.complete(identifier) or folder.undriven(identifier).is_file()
