"""The posterior names what machines lack that are integrated step by step and know nothing of the candidates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.findings import Findings
from ident.diagnosis.posterior.answer import judge_by_posterior

Make = Callable[..., Any]


def diagnosed(machine: Any, lacking: tuple[str, ...] = ()) -> Findings:
    records = [machine.drive(11)], [machine.drive(12)]
    return diagnose_axis(*records, seed=1, lacking=lacking, judged=judge_by_posterior)


def test_a_machine_that_is_the_model_lacks_nothing(machine: Make) -> None:
    assert diagnosed(machine()).verdict is Verdict.NONE


def test_an_asymmetry_is_named_with_its_size(machine: Make) -> None:
    (cause,) = diagnosed(machine(asymmetry=8.0)).causes
    assert cause.candidate.effect == "asymmetric_viscous"
    assert cause.part.values[0] == pytest.approx(8.0, abs=max(3 * cause.part.std[0], 0.1))


def test_what_has_lost_its_name_is_a_law_of_its_variable(machine: Make) -> None:
    findings = diagnosed(machine(asymmetry=8.0), lacking=("asymmetric_viscous", "quadratic_drag"))
    assert findings.verdict is Verdict.LAW
    laws = [cause.law_answer for cause in findings.causes if cause.law_answer is not None]
    assert [str(law.variable) for law in laws] == ["rate"]
