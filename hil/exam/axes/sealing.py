"""The sealing side of an exam of axes: draws machines, integrates them, writes records and a sealed answer."""

from __future__ import annotations

import secrets
from dataclasses import replace
from functools import partial
from typing import Final

from hil.exam.answer_file import answer_hash, answer_text, key_of_exam, open_answer
from hil.exam.axes.drawing import draw_axis_cases, machine_of
from hil.exam.axes.effects import machine_with
from hil.exam.axes.record_bytes import axis_record_bytes
from hil.exam.cases import SEEDS_PER_CASE, Case
from hil.exam.folder import AXES, Exam, ExamFolder, read_exam, write_exam
from hil.exam.key import make_key
from hil.exam.lots import lots_of_key, lots_of_seed
from hil.exam.order import Order
from hil.exam.sealing import SALT, Progress, drive_left, refuse_impossible, refuse_other_cases, refuse_other_lots
from hil.exam.workers import run_all
from ident.errors import UserError
from ident.writing import write_whole

ENGINE: Final = "step by step"


def seal_axes(order: Order, progress: Progress) -> Exam:
    """Seal an exam, or go on with one that was stopped.

    Raises:
        UserError: as `hil.exam.sealing.seal`, or a kind of case is asked for that axes do not have.
    """
    refuse_impossible(order)
    folder = ExamFolder(order.out)
    progress(0, order.composition.total)
    if not folder.manifest.is_file():
        _draw(folder, order)
    exam = read_exam(folder)
    refuse_other_lots(exam, order)
    key = key_of_exam(folder, exam, order.key)
    cases = open_answer(folder, exam, key)
    refuse_other_cases(cases, exam, order, (AXES, ENGINE, 0))
    drive_left(folder, exam, key, cases, drive_axis_case, lambda case: (case,), order, progress)
    return exam


def drive_axis_case(case: Case) -> tuple[str, tuple[bytes, bytes] | str]:
    """Both records of a case, or why there are none; runs in a worker."""
    machine = machine_with(machine_of(case.seed, case.excitation)[0], case.effects)
    try:
        fit, confirm = (axis_record_bytes(machine.drive(case.seed + index)) for index in range(SEEDS_PER_CASE))
    except UserError as error:
        return case.identifier, f"{error.what} {error.remedy}\n"
    return case.identifier, (fit, confirm)


def _draw(folder: ExamFolder, order: Order) -> None:
    key = None if order.key is None else make_key(order.key, folder.path)
    salt = b"" if key is None else secrets.token_bytes(SALT)
    lots = lots_of_seed(order.first_seed or 0) if key is None else lots_of_key(key, salt)
    spread = partial(run_all, jobs=order.jobs, scheduler=order.scheduler)
    cases = draw_axis_cases(order.composition, lots, spread)
    exam = Exam(
        vehicle=AXES,
        engine=ENGINE,
        cycle=0.0,
        plans=(),
        identifiers=tuple(case.identifier for case in cases),
        first_seed=order.first_seed,
        salt=salt.hex(),
        key="" if key is None else key.fingerprint(salt),
    )
    answer = answer_text(cases, exam, key)
    write_whole(answer, folder.answer)
    write_exam(folder, replace(exam, answer_hash=answer_hash(answer)))
