"""The sealing side: draws the cases, runs the emulator over CAN, writes records and a sealed answer."""

from __future__ import annotations

import os
import secrets
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final

from emulator.effects import INJECTORS, Unlibraried, Wanted
from hil.exam.answer_file import answer_hash, answer_text, key_of_exam, open_answer, undriven_text
from hil.exam.cases import Case, Injected, Kind
from hil.exam.corruptions import corruption_of
from hil.exam.drawing import Composition, draw_cases
from hil.exam.drawn_laws import law_effect
from hil.exam.folder import RECORDS, Exam, ExamFolder, read_exam, write_exam
from hil.exam.identity import planned_record
from hil.exam.key import Key, make_key
from hil.exam.lots import Lots, lots_of_key, lots_of_seed
from hil.exam.order import Order, VehicleOrder
from hil.exam.plans import ExamPlans, plan_exam, plans_from_text, plans_text
from hil.exam.record_bytes import record_bytes
from hil.exam.sizes import SizeTable
from hil.exam.workers import run_all
from hil.exam.world import World
from hil.network import load_network
from ident.effects import make_effect
from ident.errors import UserError
from ident.parameters_file import read_model
from ident.vehicle.description import find_data_file, load_vehicle
from ident.writing import write_whole

Progress = Callable[[int, int], None]
"""Called with cases done and cases in all."""

SALT: Final = 16
"""Length of the salt of an exam [bytes]."""

_EPOCH: Final = (0, 0)


def seal(order: VehicleOrder, table: SizeTable, progress: Progress) -> Exam:
    """Seal an exam, or go on with one that was stopped.

    A case whose effects stop the campaign has no records: what was wrong is sealed with the answer.

    Raises:
        UserError: no case is asked for, neither or both of key and first seed are given, the key is another one, or the
            folder holds another exam.
        DataFileError: vehicle or model cannot be read.
    """
    refuse_impossible(order)
    folder = ExamFolder(order.out)
    # The excitations take minutes before the first case is done.
    progress(0, order.composition.total)
    if not folder.manifest.is_file():
        _draw(folder, order, table)
    exam = read_exam(folder)
    refuse_other_lots(exam, order)
    key = key_of_exam(folder, exam, order.key)
    cases = open_answer(folder, exam, key)
    refuse_other_cases(cases, exam, order, (order.world.vehicle, order.world.engine, order.composition.driven))
    _refuse_other_files(folder, order)
    drive_left(
        folder,
        exam,
        key,
        cases,
        drive_case,
        lambda case: (exam.plans[case.excitation], order.world, exam.cycle, case),
        order,
        progress,
    )
    return exam


def drive_left(
    folder: ExamFolder,
    exam: Exam,
    key: Key | None,
    cases: Sequence[Case],
    driven: Callable[..., tuple[str, tuple[bytes, bytes] | str]],
    task: Callable[[Case], tuple[Any, ...]],
    order: Order,
    progress: Progress,
) -> None:
    """Write the records of all cases that have none, and why where there can be none.

    Args:
        folder, exam, key: of the exam.
        cases: all of them.
        driven: makes the records of a case, in a worker.
        task: its arguments.
        order: says on how many processes.
        progress: told how far it is.
    """
    left = [case for case in cases if not _finished(folder, case.identifier)]
    done = len(cases) - len(left)
    progress(done, len(cases))
    for identifier, contents in run_all(driven, map(task, left), jobs=order.jobs, scheduler=order.scheduler):
        if isinstance(contents, str):
            write_whole(undriven_text(identifier, contents, exam, key), folder.undriven(identifier))
        else:
            _write_records(folder, identifier, contents)
        done += 1
        progress(done, len(cases))
    if left:
        _hide_order(folder, exam)


def refuse_impossible(order: Order) -> None:
    """Refuse an exam without cases, and one that is drawn from nothing, or from two things."""
    if not order.composition.total:
        raise UserError("An exam without cases is none.", "Ask for some: --effects, --none, --unknown.")
    if (order.key is None) == (order.first_seed is None):
        raise UserError(
            "An exam is drawn either from a secret or from a seed that everybody may know.",
            "Name a file for the secret, outside the exam (--key FILE), or a seed for a set to tune on (--first-seed).",
        )


def _write_records(folder: ExamFolder, identifier: str, contents: tuple[bytes, bytes]) -> None:
    for which, content in zip(RECORDS, contents, strict=True):
        path = folder.record(identifier, which)
        write_whole(content, path)
        os.utime(path, _EPOCH)


def _hide_order(folder: ExamFolder, exam: Exam) -> None:
    """Write all records anew, one after the other: how long each was driven shows in the times of the first files."""
    for identifier in exam.identifiers:
        if folder.complete(identifier):
            fit, confirm = (folder.record(identifier, which).read_bytes() for which in RECORDS)
            _write_records(folder, identifier, (fit, confirm))


def drive_case(plans: str, world: World, cycle: float, case: Case) -> tuple[str, tuple[bytes, bytes] | str]:
    """Both records of a case, or why the vehicle cannot be driven with its effects; runs in a worker."""
    both = _plans(plans, world.vehicle, cycle)
    try:
        effects = _effects(case, both, world)
        records = [world.drive(plan, case.seed + index, effects) for index, plan in enumerate(both.driven)]
    except UserError as error:
        return case.identifier, f"{error.what} {error.remedy}\n"
    for fault in case.effects if case.kind is Kind.FAULT else ():
        corruption = corruption_of(fault.name, fault.where, fault.parameter, fault.size)
        records = [corruption.apply(record) for record in records]
    fit, confirm = records
    return case.identifier, (record_bytes(fit), record_bytes(confirm))


def _effects(case: Case, plans: ExamPlans, world: World) -> list[Wanted]:
    """What the vehicle of a case has."""
    match case.kind:
        case Kind.FAULT:
            return []
        case Kind.LAW:
            planned = planned_record(plans.fit, load_vehicle(world.vehicle).prior)
            return [law_effect(law, planned) for law in case.effects]
        case _:
            return [effect_of(injected) for injected in case.effects]


def effect_of(injected: Injected) -> Wanted:
    """What the emulator injects."""
    if not INJECTORS[injected.name].known:
        return Unlibraried(injected.name, injected.where, injected.size)
    return make_effect(injected.name, injected.where, {injected.parameter: injected.size})


@lru_cache(maxsize=Composition.excitations)
def _plans(text: str, vehicle: str, cycle: float) -> ExamPlans:
    return plans_from_text(text, load_vehicle(vehicle), cycle)


def _draw(folder: ExamFolder, order: VehicleOrder, table: SizeTable) -> None:
    """Everything but the records."""
    read_model(order.model)  # Whether it is one must show now, not when the exam is diagnosed.
    cycle = load_network(order.world.network_file).cycle_period
    key = None if order.key is None else make_key(order.key, folder.path)
    salt = b"" if key is None else secrets.token_bytes(SALT)
    lots = _lots(order, key, salt)
    cases = draw_cases(table, order.composition, lots.noise, lots.questions, lots.identifiers)
    exam = Exam(
        vehicle=order.world.vehicle,
        engine=order.world.engine,
        cycle=cycle,
        plans=_draw_plans(order, lots, cycle),
        identifiers=tuple(case.identifier for case in cases),
        first_seed=order.first_seed,
        salt=salt.hex(),
        key="" if key is None else key.fingerprint(salt),
    )
    answer = answer_text(cases, exam, key)
    write_whole(answer, folder.answer)
    write_whole(find_data_file("ident.vehicle", order.world.vehicle).read_bytes(), folder.vehicle)
    write_whole(order.model.read_bytes(), folder.model)
    write_exam(folder, replace(exam, answer_hash=answer_hash(answer)))


def _lots(order: VehicleOrder, key: Key | None, salt: bytes) -> Lots:
    if key is not None:
        return lots_of_key(key, salt)
    assert order.first_seed is not None
    return lots_of_seed(order.first_seed)


def _draw_plans(order: VehicleOrder, lots: Lots, cycle: float) -> tuple[str, ...]:
    tasks = [
        (number, order.world.vehicle, lots.excitation(number), cycle) for number in range(order.composition.driven)
    ]
    return tuple(text for _, text in sorted(run_all(draw_plans, tasks, jobs=order.jobs, scheduler=order.scheduler)))


def draw_plans(number: int, vehicle: str, seed: int, cycle: float) -> tuple[int, str]:
    """A pair of campaigns under its number; runs in a worker."""
    return number, plans_text(plan_exam(load_vehicle(vehicle), seed, cycle))


def refuse_other_lots(exam: Exam, order: Order) -> None:
    """Refuse to go on with an exam that was drawn from something else."""
    if exam.sealed and order.key is None:
        raise UserError(
            f"{order.out} holds a sealed exam.", "Go on with its key (--key), or name another folder (--out)."
        )
    if exam.first_seed != order.first_seed:
        raise UserError(
            f"{order.out} holds another exam, not sealed, from seed {exam.first_seed}.",
            f"Go on with it by --first-seed {exam.first_seed}, or name another folder (--out).",
        )


def refuse_other_cases(cases: Sequence[Case], exam: Exam, order: Order, world: tuple[str, str, int]) -> None:
    """Refuse to go on with an exam of another composition, or another world: its vehicle, engine and excitations."""
    wanted = order.composition
    held = Counter(case.kind for case in cases)
    if (exam.vehicle, exam.engine, len(exam.plans), held) != (*world, Counter(wanted.asked)):
        kinds = ", ".join(f"{held[kind]} {kind}" for kind in wanted.asked)
        raise UserError(
            f"{order.out} holds another exam: {kinds} of {exam.world} on {len(exam.plans)} excitations.",
            "Go on with it as it was begun, or name another folder (--out).",
        )


def _refuse_other_files(folder: ExamFolder, order: VehicleOrder) -> None:
    """The cases that are left are driven with the vehicle file of the order, not with its copy in the folder."""
    for asked, held in (
        (find_data_file("ident.vehicle", order.world.vehicle), folder.vehicle),
        (order.model, folder.model),
    ):
        if asked.read_bytes() != held.read_bytes():
            raise UserError(
                f"{asked} is not the {held.name} that {order.out} was begun with.",
                "Go on with it as it was begun, or name another folder (--out).",
            )


def _finished(folder: ExamFolder, identifier: str) -> bool:
    return folder.complete(identifier) or folder.undriven(identifier).is_file()
