"""Sealing, whatever an exam is of: cases are drawn from lots and driven one by one; it goes on where it stopped."""

from __future__ import annotations

import os
import secrets
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from hil.exam.answer_file import answer_hash, answer_text, key_of_exam, open_answer, undriven_text
from hil.exam.cases import Case
from hil.exam.folder import RECORDS, Exam, ExamFolder, read_exam, write_exam
from hil.exam.key import Key, make_key
from hil.exam.lots import Lots, lots_of_key, lots_of_seed
from hil.exam.order import Order
from hil.exam.workers import run_all
from ident.errors import UserError
from ident.writing import write_whole

Progress = Callable[[int, int], None]
"""Called with cases done and cases in all."""

Contents = tuple[str, tuple[bytes, bytes] | str]
"""Identifier of a case, and both of its records, or why it cannot be driven."""

SALT: Final = 16
"""Length of the salt of an exam [bytes]."""

_EPOCH: Final = (0, 0)


@dataclass(frozen=True)
class Subject:
    """What an exam is of.

    Attributes:
        vehicle, engine, cycle: as `Exam` has them.
        excitations: pairs of campaigns that its cases drive.
        files: that the diagnosing side may see, by their names in the folder.
        draw: from lots, all cases and the texts of their plans.
        drive: makes the records of a case, in a worker.
        task: its arguments.
    """

    vehicle: str
    engine: str
    cycle: float
    excitations: int
    files: Mapping[str, Path]
    draw: Callable[[Lots], tuple[Sequence[Case], tuple[str, ...]]]
    drive: Callable[..., Contents]
    task: Callable[[Exam, Case], tuple[Any, ...]]


def seal_exam(order: Order, subject: Subject, progress: Progress) -> Exam:
    """Seal an exam, or go on with one that was stopped.

    A case that cannot be driven has no records: what was wrong is sealed with the answer.

    Args:
        order: what is asked for.
        subject: what it is asked of.
        progress: told how far it is.

    Raises:
        UserError: no case is asked for, neither or both of key and first seed are given, the key is another one, or the
            folder holds another exam.
    """
    _refuse_impossible(order)
    folder = ExamFolder(order.out)
    # What is drawn takes minutes before the first case is done.
    progress(0, order.composition.total)
    if not folder.manifest.is_file():
        _draw(folder, order, subject)
    exam = read_exam(folder)
    _refuse_other_lots(exam, order)
    key = key_of_exam(folder, exam, order.key)
    cases = open_answer(folder, exam, key)
    _refuse_other(cases, exam, order, subject)
    _refuse_other_files(folder, order, subject)
    _drive_left(folder, exam, key, cases, subject, order, progress)
    return exam


def _draw(folder: ExamFolder, order: Order, subject: Subject) -> None:
    """Everything but the records."""
    key = None if order.key is None else make_key(order.key, folder.path)
    salt = b"" if key is None else secrets.token_bytes(SALT)
    cases, plans = subject.draw(_lots(order, key, salt))
    exam = Exam(
        vehicle=subject.vehicle,
        engine=subject.engine,
        cycle=subject.cycle,
        plans=plans,
        identifiers=tuple(case.identifier for case in cases),
        first_seed=order.first_seed,
        salt=salt.hex(),
        key="" if key is None else key.fingerprint(salt),
    )
    answer = answer_text(cases, exam, key)
    write_whole(answer, folder.answer)
    for name, file in subject.files.items():
        write_whole(file.read_bytes(), folder.path / name)
    write_exam(folder, replace(exam, answer_hash=answer_hash(answer)))


def _lots(order: Order, key: Key | None, salt: bytes) -> Lots:
    if key is not None:
        return lots_of_key(key, salt)
    assert order.first_seed is not None
    return lots_of_seed(order.first_seed)


def _drive_left(
    folder: ExamFolder,
    exam: Exam,
    key: Key | None,
    cases: Sequence[Case],
    subject: Subject,
    order: Order,
    progress: Progress,
) -> None:
    """Write the records of all cases that have none, and why where there can be none."""
    left = [
        case for case in cases if not (folder.complete(case.identifier) or folder.undriven(case.identifier).is_file())
    ]
    done = len(cases) - len(left)
    progress(done, len(cases))
    tasks = (subject.task(exam, case) for case in left)
    for identifier, contents in run_all(subject.drive, tasks, jobs=order.jobs, scheduler=order.scheduler):
        if isinstance(contents, str):
            write_whole(undriven_text(identifier, contents, exam, key), folder.undriven(identifier))
        else:
            _write_records(folder, identifier, contents)
        done += 1
        progress(done, len(cases))
    if left:
        _hide_order(folder, exam)


def _finished(folder: ExamFolder, identifier: str) -> bool:
    return folder.complete(identifier) or folder.undriven(identifier).is_file()


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


def _refuse_impossible(order: Order) -> None:
    """Refuse an exam without cases, and one that is drawn from nothing, or from two things."""
    if not order.composition.total:
        raise UserError("An exam without cases is none.", "Ask for some: --effects, --none, --unknown.")
    if (order.key is None) == (order.first_seed is None):
        raise UserError(
            "An exam is drawn either from a secret or from a seed that everybody may know.",
            "Name a file for the secret, outside the exam (--key FILE), or a seed for a set to tune on (--first-seed).",
        )


def _refuse_other_lots(exam: Exam, order: Order) -> None:
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


def _refuse_other(cases: Sequence[Case], exam: Exam, order: Order, subject: Subject) -> None:
    """Refuse to go on with an exam of another composition, or another world: its vehicle, engine and excitations."""
    wanted = order.composition
    held = Counter(case.kind for case in cases)
    ours = (subject.vehicle, subject.engine, subject.excitations, Counter(wanted.asked))
    if (exam.vehicle, exam.engine, len(exam.plans), held) != ours:
        kinds = ", ".join(f"{held[kind]} {kind}" for kind in wanted.asked)
        raise UserError(
            f"{order.out} holds another exam: {kinds} of {exam.world} on {len(exam.plans)} excitations.",
            "Go on with it as it was begun, or name another folder (--out).",
        )


def _refuse_other_files(folder: ExamFolder, order: Order, subject: Subject) -> None:
    """The cases that are left are driven with the files of the order, not with their copies in the folder."""
    for name, asked in subject.files.items():
        if asked.read_bytes() != (folder.path / name).read_bytes():
            raise UserError(
                f"{asked} is not the {name} that {order.out} was begun with.",
                "Go on with it as it was begun, or name another folder (--out).",
            )
