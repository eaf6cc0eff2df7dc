"""Faults of the record as reasons against the result that was found from it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from ident.assessment.verdict import Reason, Verdict
from ident.errors import EstimationError
from ident.faults import Fault, FaultName

_SOUND: Final = {FaultName.SCALED: 1.0, FaultName.NEGATED: 1.0}
"""What the value of a fault is in a sound record; zero of the others."""


def fault_reasons(faults: Iterable[Fault]) -> list[Reason]:
    """Sure faults, each of which makes a result unusable; samples that are missing alone make it doubtful."""
    return [
        Reason(
            code=fault.name,
            channel=f"{fault.step}.{fault.channel}" if fault.step else fault.channel,
            value=fault.value,
            limit=_SOUND.get(fault.name, 0.0),
            text=f"The record is at fault: {fault.text}. {fault.remedy}",
            verdict=Verdict.DOUBTFUL if fault.name is FaultName.LOST else Verdict.UNUSABLE,
        )
        for fault in faults
        if fault.sure
    ]


def blamed_on(error: EstimationError, faults: Iterable[Fault]) -> EstimationError:
    """The error with the fault of the record that explains it, where there is one."""
    sure = [fault for fault in faults if fault.sure]
    return EstimationError(f"The record is at fault: {sure[0].text}. {error.what}", sure[0].remedy) if sure else error
