"""Machines as textbooks have them, seen by the core."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from hil.exam.sources.machine import Machine
from ident.diagnosis.core.answer import diagnose_by_core
from ident.diagnosis.diagnosis import Diagnosis


@pytest.fixture
def carriage() -> Machine:
    """Ten seconds between random points, at five speeds."""
    return Machine(
        mass=20.0, viscous=60.0, coulomb=8.0, noise=0.1, encoder=2e-7, rate=500.0, substeps=8, repeats=1,
        duration=10.0, strokes=12, speeds=(0.05, 0.1, 0.15, 0.2, 0.25), travel=0.25,
    )  # fmt: skip


@pytest.fixture
def said(carriage: Machine) -> Callable[..., Diagnosis]:
    """What the core says of the carriage with something else about it."""

    def diagnosed(*lacking: str, **changed: object) -> Diagnosis:
        machine = replace(carriage, **changed)  # type: ignore[arg-type]
        return diagnose_by_core([machine.drive(11)], [machine.drive(12)], lacking=lacking)

    return diagnosed
