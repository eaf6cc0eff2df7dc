"""The folder of an exam: what the diagnosing side may see, and the sealed answer.

| entry | what |
|---|---|
| `exam.json` | identifiers in shuffled order, excitations, whether it is sealed, hash of the answer |
| `vehicle.toml`, `model.toml` | what is known of the vehicle, and the model under test |
| `cases/ID.fit.parquet`, `cases/ID.confirm.parquet` | the records, all of one size and date |
| `truth/answer.json` | the answer, encrypted; `exam score` opens it with the key, which lies elsewhere |
| `truth/ID.json` | why a case could not be driven, encrypted as well |
| `diagnoses/ID.json` | answers of the diagnosing side |
| `diagnoses_without/ID.json` | the same with the true candidate left out of the library |
| `oracle/ID.json` | what somebody would find who knows the true candidate |
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ident.errors import UserError
from ident.reading import read_json
from ident.writing import write_whole

SCHEMA: Final = "quasiomni.exam/4"
RECORDS: Final = ("fit", "confirm")

AXES: Final = "drawn axes"
"""What stands for the vehicle of an exam of axes, each of another machine."""


@dataclass(frozen=True)
class ExamFolder:
    """Paths inside the folder of an exam.

    Attributes:
        path: of the folder.
    """

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
        """The model under test."""
        return self.path / "model.toml"

    @property
    def answer(self) -> Path:
        """The answer."""
        return self.path / "truth" / "answer.json"

    def record(self, identifier: str, which: str) -> Path:
        """One of the RECORDS of a case."""
        return self.path / "cases" / f"{identifier}.{which}.parquet"

    def complete(self, identifier: str) -> bool:
        """Whether both records of a case are there."""
        return all(self.record(identifier, which).is_file() for which in RECORDS)

    def undriven(self, identifier: str) -> Path:
        """Why a case could not be driven; sealed as the answer is."""
        return self.path / "truth" / f"{identifier}.json"

    def diagnosis(self, identifier: str, removed: bool = False) -> Path:
        """What the diagnosing side answered; with the true candidate removed, or with all."""
        return self.path / ("diagnoses_without" if removed else "diagnoses") / f"{identifier}.json"

    def oracle(self, identifier: str) -> Path:
        """Evidence of candidates that somebody knows, of a case."""
        return self.path / "oracle" / f"{identifier}.json"

    def diagnosed(self, removed: bool = False) -> bool:
        """Whether there is any diagnosis, with the true candidate removed, or with all."""
        return any(self.diagnosis("any", removed).parent.glob("*.json"))


@dataclass(frozen=True)
class Exam:
    """What everyone may know of an exam.

    Attributes:
        vehicle, engine: the world that the cases are driven in: name or path, and name.
        cycle: T_s [s].
        plans: the pairs of campaigns that the cases drive, as JSON texts.
        identifiers: of the cases, in shuffled order.
        first_seed: that everything follows from, in an exam that is not sealed; None: it is.
        salt: of everything derived from the key, hexadecimal; empty where it is not sealed.
        key: fingerprint of the key; empty where it is not sealed.
        answer_hash: SHA-256 of the file of the answer.
    """

    vehicle: str
    engine: str
    cycle: float
    plans: tuple[str, ...]
    identifiers: tuple[str, ...]
    first_seed: int | None
    salt: str
    key: str
    answer_hash: str = ""

    @property
    def world(self) -> str:
        """Vehicle and engine in words."""
        return f"{self.vehicle} in {self.engine}"

    @property
    def of_axes(self) -> bool:
        """Whether its records are of servo axes."""
        return self.vehicle == AXES

    @property
    def sealed(self) -> bool:
        """Whether the answer takes a key."""
        return self.first_seed is None

    def context(self, what: str) -> bytes:
        """What a sealed text belongs to: all of the manifest but the hash of the answer, and what it is."""
        known = {name: value for name, value in vars(self).items() if name != "answer_hash"}
        return json.dumps([SCHEMA, known, what], sort_keys=True).encode()


def write_exam(folder: ExamFolder, exam: Exam) -> None:
    """Write the manifest."""
    content = {"schema": SCHEMA, "sealed": exam.sealed, **vars(exam)}
    write_whole(json.dumps(content, indent=1), folder.manifest)


def read_exam(folder: ExamFolder) -> Exam:
    """Read the manifest.

    Raises:
        UserError: there is none, or another version wrote it.
    """
    if not folder.manifest.is_file():
        raise UserError(f"{folder.path} holds no exam.", "Seal one first: quasiomni exam seal --out FOLDER.")
    content = read_json(folder.manifest)
    schema = content.pop("schema", None) if isinstance(content, dict) else None
    if schema != SCHEMA:
        raise UserError(
            f"{folder.manifest} has the schema {schema}, not {SCHEMA}.",
            "Go on with the version that sealed it, or seal the exam again into another folder.",
        )
    content.pop("sealed", None)
    try:
        return Exam(**{**content, "plans": tuple(content["plans"]), "identifiers": tuple(content["identifiers"])})
    except (KeyError, TypeError) as error:
        raise UserError(
            f"{folder.manifest} is damaged: {error!r}.", "Restore it from a copy: without it nothing is scored."
        ) from error
