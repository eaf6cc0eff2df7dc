"""The folder of an exam: what the diagnosing side may see, and the sealed answer.

| entry | what |
|---|---|
| `exam.json` | identifiers in shuffled order, excitations, hash of the answer |
| `vehicle.toml`, `model.toml` | what is known of the vehicle, and the model to be judged |
| `cases/ID.fit.parquet`, `cases/ID.confirm.parquet` | the records, all of one size and date |
| `sealed/answer.bin` | the answer; `exam score` opens it |
| `diagnoses/ID.json` | answers of the diagnosing side |
"""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from hil.exam.cases import Case, case_from_json
from ident.errors import UserError
from ident.writing import write_whole

SCHEMA: Final = "quasiomni.exam/2"
RECORDS: Final = ("fit", "confirm")


@dataclass(frozen=True)
class ExamFolder:
    """Paths inside the folder of an exam."""

    path: Path

    @property
    def manifest(self) -> Path:
        """What everyone may know."""
        return self.path / "exam.json"

    @property
    def vehicle(self) -> Path:
        """What is known of the vehicle."""
        return self.path / "vehicle.toml"

    @property
    def model(self) -> Path:
        """The model that is judged."""
        return self.path / "model.toml"

    @property
    def answer(self) -> Path:
        """The sealed answer."""
        return self.path / "sealed" / "answer.bin"

    def record(self, identifier: str, which: str) -> Path:
        """One of the RECORDS of a case."""
        return self.path / "cases" / f"{identifier}.{which}.parquet"

    def complete(self, identifier: str) -> bool:
        """Whether both records of a case are there."""
        return all(self.record(identifier, which).is_file() for which in RECORDS)

    def undriven(self, identifier: str) -> Path:
        """Why a case could not be driven; sealed with the answer."""
        return self.path / "sealed" / f"{identifier}.txt"

    def diagnosis(self, identifier: str, removed: bool = False) -> Path:
        """What the diagnosing side answered; with the true candidate removed, or with all."""
        return self.path / ("diagnoses_without" if removed else "diagnoses") / f"{identifier}.json"

    def diagnosed(self, removed: bool = False) -> bool:
        """Whether there is any diagnosis, with the true candidate removed, or with all."""
        return any(self.diagnosis("any", removed).parent.glob("*.json"))


@dataclass(frozen=True)
class Exam:
    """What everyone may know of an exam.

    Attributes:
        prototype: of the emulator, by name.
        cycle: T_s [s].
        plans: the pairs of campaigns that the cases drive, as JSON texts.
        identifiers: of the cases, in shuffled order.
        answer_hash: SHA-256 of the sealed answer.
    """

    prototype: str
    cycle: float
    plans: tuple[str, ...]
    identifiers: tuple[str, ...]
    answer_hash: str


def write_exam(folder: ExamFolder, exam: Exam) -> None:
    """Write the manifest."""
    content = {"schema": SCHEMA, **vars(exam)}
    write_whole(json.dumps(content, indent=1), folder.manifest)


def read_exam(folder: ExamFolder) -> Exam:
    """Read the manifest.

    Raises:
        UserError: there is none, or another version wrote it.
    """
    try:
        content: dict[str, Any] = json.loads(folder.manifest.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UserError(
            f"{folder.path} holds no exam: {error}.", "Seal one first: quasiomni exam seal --out FOLDER."
        ) from error
    if (schema := content.pop("schema", None)) != SCHEMA:
        raise UserError(
            f"{folder.manifest} has the schema {schema}, not {SCHEMA}.",
            "Go on with the version that sealed it, or seal the exam again into another folder.",
        )
    return Exam(**{**content, "plans": tuple(content["plans"]), "identifiers": tuple(content["identifiers"])})


def sealed(cases: Sequence[Case], salt: bytes) -> bytes:
    """The answer, not to be read by accident; the salt keeps its hash from being guessed."""
    content = {"salt": salt.hex(), "cases": [case.as_json() for case in cases]}
    return zlib.compress(json.dumps(content).encode(), 9)


def answer_hash(content: bytes) -> str:
    """What is published of the answer."""
    return hashlib.sha256(content).hexdigest()


def open_answer(folder: ExamFolder, expected: str | None) -> list[Case]:
    """Open the sealed answer.

    Args:
        folder: of the exam.
        expected: hash that was published; None while sealing.

    Raises:
        UserError: there is no answer, or it is not the one that was sealed.
    """
    try:
        content = folder.answer.read_bytes()
    except OSError as error:
        raise UserError(f"{folder.answer} cannot be read: {error.strerror}.", "Seal the exam again.") from error
    if expected is not None and answer_hash(content) != expected:
        raise UserError(f"{folder.answer} is not the answer that was sealed.", "Restore it, or seal the exam again.")
    return [case_from_json(entry) for entry in json.loads(zlib.decompress(content))["cases"]]
