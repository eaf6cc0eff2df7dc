"""The diagnosing side: records and model in, answers out. It never imports the emulator."""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import json
import math
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, Final

from hil.exam.axes.record_bytes import axis_record_of
from hil.exam.folder import RECORDS, ExamFolder, read_exam
from hil.exam.record_bytes import record_from_bytes
from hil.exam.workers import run_all
from ident.diagnosis.answer.alone import closed_alone
from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.diagnosis import faulty
from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Problem
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.effects.extended import ExtendedModel
from ident.errors import UserError
from ident.faults import sure_faults
from ident.parameters_file import read_model
from ident.records.axis_record import AxisRecord
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.writing import write_whole

FORBIDDEN: Final = ("emulator", "pybullet", "mujoco")
"""Packages that would know the answers."""

_FAILED: Final[Mapping[str, Any]] = MappingProxyType(
    {"verdict": "failed", "effects": [], "invisible": [], "gap": {"closed": None}}
)

Progress = Callable[[int, int], None]


class _Refusal(importlib.abc.MetaPathFinder):
    """Refuses to find what is forbidden."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Nothing, for every other module."""
        if fullname.partition(".")[0] in FORBIDDEN:
            raise ImportError(f"the diagnosing side of an exam must not import {fullname}")
        return None


def forbid_emulator() -> None:
    """From now on this process cannot import the emulator.

    Raises:
        UserError: it has done so already.
    """
    known = sorted(name for name in FORBIDDEN if name in sys.modules)
    if known:
        raise UserError(f"This process has imported {known[0]}.", "Diagnose in a process of its own.")
    if not any(isinstance(finder, _Refusal) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Refusal())


def diagnose_exam(
    folder: ExamFolder,
    *,
    jobs: int,
    scheduler: str | None,
    progress: Progress,
    removed: Mapping[str, str] | None = None,
) -> None:
    """Diagnose all cases that have records and no answer yet.

    The order of the cases is random, so those of an exam that is sealed in part are a fair sample of it.

    Args:
        folder: of the exam.
        jobs: processes on this machine.
        scheduler: of a Dask cluster, None for this machine.
        progress: called with cases done and in all.
        removed: candidate that is taken out of the library, by case; all of them are left in without.

    Raises:
        UserError: there is no exam, or it has no records yet; or candidates are to be removed from a sealed one before
            all of its cases have been diagnosed with all of them.
    """
    forbid_emulator()
    exam = read_exam(folder)
    there = with_records(folder, exam.identifiers)
    if removed is not None and exam.sealed:
        refuse_undiagnosed(folder, there)
    asked = [identifier for identifier in there if removed is None or identifier in removed]
    task = _axis_task(folder, removed or {}) if exam.of_axes else _vehicle_task(folder, removed or {})
    function = diagnose_axis_case if exam.of_axes else diagnose_case
    places = {identifier: folder.diagnosis(identifier, removed is not None) for identifier in asked}
    keep_answers(function, task, places, jobs=jobs, scheduler=scheduler, progress=progress)


def with_records(folder: ExamFolder, identifiers: Sequence[str]) -> list[str]:
    """The cases whose records are there.

    Raises:
        UserError: there are none.
    """
    there = [identifier for identifier in identifiers if folder.complete(identifier)]
    if not there:
        raise UserError(
            f"{folder.path} holds no records yet.", "Seal first: quasiomni exam seal goes on where it stopped."
        )
    return there


def keep_answers(
    function: Callable[..., tuple[str, bytes]],
    task: Callable[[str], tuple[Any, ...]],
    places: Mapping[str, Path],
    *,
    jobs: int,
    scheduler: str | None,
    progress: Progress,
) -> None:
    """Answer every case that has no answer yet, and write each as it comes.

    Args:
        function: gives the identifier of a case and its answer; runs in workers.
        task: its arguments, by identifier.
        places: where answers belong, by identifier.
        jobs: processes on this machine.
        scheduler: of a Dask cluster, None for this machine.
        progress: called with cases done and in all.
    """
    left = [identifier for identifier, place in places.items() if not place.is_file()]
    before = len(places) - len(left)
    progress(before, len(places))
    answers = run_all(function, map(task, left), jobs=jobs, scheduler=scheduler)
    for done, (identifier, content) in enumerate(answers, before + 1):
        write_whole(content, places[identifier])
        progress(done, len(places))


def _vehicle_task(folder: ExamFolder, removed: Mapping[str, str]) -> Callable[[str], tuple[Any, ...]]:
    """Arguments of `diagnose_case` for a case."""
    texts = descriptions(folder)
    return lambda identifier: (identifier, *both_records(folder, identifier), *texts, removed.get(identifier))


def _axis_task(folder: ExamFolder, removed: Mapping[str, str]) -> Callable[[str], tuple[Any, ...]]:
    """Arguments of `diagnose_axis_case` for a case."""
    return lambda identifier: (identifier, *both_records(folder, identifier), removed.get(identifier))


def descriptions(folder: ExamFolder) -> tuple[str, str]:
    """Texts of the files of the vehicle and of the model under test."""
    return folder.vehicle.read_text(encoding="utf-8"), folder.model.read_text(encoding="utf-8")


def both_records(folder: ExamFolder, identifier: str) -> tuple[bytes, ...]:
    """The records of a case to fit and to confirm, as Parquet."""
    return tuple(folder.record(identifier, which).read_bytes() for which in RECORDS)


def refuse_undiagnosed(folder: ExamFolder, identifiers: Sequence[str]) -> None:
    """Refuse to leave true candidates out while some answers are missing: which cases have one shows afterwards.

    Raises:
        UserError: one of the cases has no answer yet.
    """
    missing = sum(not folder.diagnosis(identifier).is_file() for identifier in identifiers)
    if missing:
        raise UserError(
            f"{missing} cases of {folder.path} are not diagnosed yet, and leaving true candidates out tells of them.",
            f"Diagnose all of them first: quasiomni exam diagnose {folder.path}.",
        )


def diagnose_case(
    identifier: str, fit: bytes, confirm: bytes, vehicle: str, model: str, removed: str | None
) -> tuple[str, bytes]:
    """Diagnosis of one case as JSON; runs in a worker.

    Beside the diagnosis it holds `seconds`, the processor time that it took, and `alone`, what every name of the
    library would close in place of the answer (`closed_alone`), not for a library that lacks one.

    Args:
        identifier: of the case.
        fit, confirm: its records, as Parquet.
        vehicle, model: texts of the files.
        removed: candidate that the library is to lack.
    """
    forbid_emulator()
    world = described(vehicle, model)
    effects = [name for name in EffectName if name != removed]

    def answer() -> dict[str, Any]:
        records = vehicle_records(fit, confirm)
        faults = sure_faults(records, world[0])
        if faults:
            return faulty(faults).as_json()
        found = diagnose_vehicle(records[:1], records[1:], *world, effects=effects)
        return found.diagnosis.as_json() | ({} if removed else {"alone": _alone(found.findings, found.problems)})

    return identifier, _timed(answer)


def described(vehicle: str, model: str) -> tuple[VehicleDescription, ExtendedModel]:
    """What the texts of their files say of vehicle and model."""
    with tempfile.TemporaryDirectory() as scratch:
        files = [Path(scratch) / name for name in ("vehicle.toml", "model.toml")]
        for file, text in zip(files, (vehicle, model), strict=True):
            file.write_text(text, encoding="utf-8")
        return load_vehicle(files[0]), read_model(files[1])


def diagnose_axis_case(identifier: str, fit: bytes, confirm: bytes, removed: str | None) -> tuple[str, bytes]:
    """The same of a case of an axis."""
    forbid_emulator()
    lacking = () if removed is None else (removed,)

    def answer() -> dict[str, Any]:
        records = axis_records(fit, confirm)
        return diagnose_axis(records[:1], records[1:], seed=1, lacking=lacking).diagnosis().as_json()

    return identifier, _timed(answer)


def vehicle_records(fit: bytes, confirm: bytes) -> list[Record]:
    """Records of a vehicle to fit and to confirm, from their Parquet."""
    return [record_from_bytes(content, which) for content, which in zip((fit, confirm), RECORDS, strict=True)]


def axis_records(fit: bytes, confirm: bytes) -> list[AxisRecord]:
    """The same of an axis."""
    return [axis_record_of(content, which) for content, which in zip((fit, confirm), RECORDS, strict=True)]


def _timed(answer: Callable[[], dict[str, Any]]) -> bytes:
    """An answer with its processor time; one case that fails must not end an exam of hours, and counts as wrong."""
    started = time.process_time()
    try:
        content = answer()
    except (ArithmeticError, ValueError, UserError) as error:
        content = {**_FAILED, "error": repr(error)}
    return json.dumps({**content, "seconds": time.process_time() - started}).encode()


def _alone(findings: Findings, problems: Sequence[Problem]) -> list[dict[str, Any]]:
    keys = [cause.candidate.key for cause in findings.causes]
    return [
        {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in vars(one).items()}
        for one in closed_alone(findings, problems, keys)
    ]
