from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import pytest

import quasiomni


@dataclass(frozen=True)
class Answer:
    """What a command left on the screen, and its exit code."""

    code: int
    out: str
    err: str

    @property
    def error(self) -> str:
        """What it complained about, on one line."""
        return " ".join(self.err.split())


@pytest.fixture
def quasi(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Answer]:
    """The command line in this process: `quasi("identify", path)`."""

    def run(*arguments: object) -> Answer:
        monkeypatch.setattr(sys, "argv", ["quasiomni", *(str(argument) for argument in arguments)])
        capsys.readouterr()
        try:
            quasiomni.main()
            code = 0
        except SystemExit as leave:
            code = int(leave.code or 0)
        captured = capsys.readouterr()
        return Answer(code, captured.out, captured.err)

    return run
