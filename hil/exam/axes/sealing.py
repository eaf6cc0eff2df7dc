"""The sealing side of an exam of axes: draws machines, and integrates them."""

from __future__ import annotations

from functools import partial
from typing import Final

from hil.exam.axes.drawing import draw_axis_cases, machine_of
from hil.exam.axes.effects import machine_with
from hil.exam.axes.record_bytes import axis_record_bytes
from hil.exam.cases import SEEDS_PER_CASE, Case
from hil.exam.folder import AXES, Exam
from hil.exam.order import Order
from hil.exam.sealed import Contents, Progress, Subject, seal_exam
from hil.exam.workers import run_all
from ident.errors import UserError

ENGINE: Final = "step by step"


def seal_axes(order: Order, progress: Progress) -> Exam:
    """Seal an exam of axes, or go on with one that was stopped.

    Raises:
        UserError: as `seal_exam`, or a kind of case is asked for that axes do not have.
    """
    spread = partial(run_all, jobs=order.jobs, scheduler=order.scheduler)
    subject = Subject(
        vehicle=AXES,
        engine=ENGINE,
        cycle=0.0,
        excitations=0,
        files={},
        draw=lambda lots: (draw_axis_cases(order.composition, lots, spread), ()),
        drive=drive_axis_case,
        task=lambda _exam, case: (case,),
    )
    return seal_exam(order, subject, progress)


def drive_axis_case(case: Case) -> Contents:
    """Both records of a case, or why there are none; runs in a worker."""
    machine = machine_with(machine_of(case.seed, case.excitation)[0], case.effects)
    try:
        fit, confirm = (axis_record_bytes(machine.drive(case.seed + index)) for index in range(SEEDS_PER_CASE))
    except UserError as error:
        return case.identifier, f"{error.what} {error.remedy}\n"
    return case.identifier, (fit, confirm)
