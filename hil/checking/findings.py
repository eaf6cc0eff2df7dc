"""What a check has found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ident.errors import UserError
from ident.faults import Fault


class Severity(StrEnum):
    """How much a finding matters."""

    UNREADABLE = "unreadable"
    """A file cannot be used at all."""
    ERROR = "error"
    """The files do not describe one vehicle."""
    WARNING = "warning"
    """They can, but a number is one that such vehicles hardly have."""
    ASSUMED = "assumed"
    """No file says it."""


@dataclass(frozen=True)
class Finding:
    """One thing that was found.

    Attributes:
        severity: how much it matters.
        code: what kind of thing it is; stable, for programs.
        where: file, and the place in it.
        text: one sentence.
        remedy: what to do, empty where nothing has to be done.
        fault: of the record, where that is what was found.
    """

    severity: Severity
    code: str
    where: str
    text: str
    remedy: str = ""
    fault: Fault | None = None

    def to_json(self) -> dict[str, str]:
        """As plain values."""
        return {
            "severity": self.severity.value,
            "code": self.code,
            "where": self.where,
            "text": self.text,
            "remedy": self.remedy,
        }


def unreadable(where: str, error: UserError) -> Finding:
    """A file that cannot be used."""
    return Finding(Severity.UNREADABLE, "unreadable", where, error.what, error.remedy)
