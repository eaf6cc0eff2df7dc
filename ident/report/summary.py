"""The result in plain words, and what a reader must be warned of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ident.assessment.fit import COORDINATE_WORDS
from ident.estimate.result import Identification
from ident.records.record import Record
from ident.report.digits import percent
from ident.report.rows import LEAST_SQUARES, ParameterRow, Role, StepRow


@dataclass(frozen=True)
class Summary:
    """What stands on top of the report.

    Attributes:
        sentences: what was identified, how well, and what was validated.
        warnings: what to know before building on it, beside what its assessment says.
    """

    sentences: tuple[str, ...]
    warnings: tuple[str, ...]


def summarise(
    vehicle: str,
    identification: Identification,
    record: Record,
    parameters: Sequence[ParameterRow],
    steps: Sequence[StepRow],
) -> Summary:
    """Sentences and warnings from the numbers of an identification."""
    sentences = [
        _what(vehicle, record, steps),
        _inertia(identification),
        _how_well(parameters),
        *_against_truth(parameters),
        *_validation(steps),
    ]
    warnings = [*_exact_inertia(identification), *_unrepeated(steps), *_not_validated(steps)]
    return Summary(tuple(sentences), tuple(warnings))


def _what(vehicle: str, record: Record, steps: Sequence[StepRow]) -> str:
    names = list(dict.fromkeys(row.floor.step for row in steps if row.role is Role.FIT))
    return (
        f"The dynamic parameters of the vehicle “{vehicle}” were identified from {len(names)} steps "
        f"({', '.join(names)}). The record holds {record.duration:.0f} s of driving at "
        f"{1 / record.sample_time:.0f} Hz, all steps counted."
    )


def _inertia(identification: Identification) -> str:
    estimate = identification["B_w"]
    if estimate.method == LEAST_SQUARES:
        return "B_w, which no motion on the floor can show, was identified with the wheels in the air."
    return f"B_w, which no motion on the floor can show, was given: {estimate.method}."


def _how_well(parameters: Sequence[ParameterRow]) -> str:
    ranked = sorted(parameters, key=lambda row: row.half_width)
    best, worst = ranked[0], ranked[-1]
    return (
        f"The 95 % intervals reach from ±{percent(best.half_width)} ({best.estimate.name}) to "
        f"±{percent(worst.half_width)} ({worst.estimate.name}) of the value."
    )


def _against_truth(parameters: Sequence[ParameterRow]) -> list[str]:
    known = [row for row in parameters if row.error is not None]
    if not known:
        return []
    covered = sum(row.covered is True for row in known)
    worst = max(known, key=lambda row: abs(row.error or 0.0))
    return [
        f"The truth is known here: {covered} of {len(known)} intervals hold it, and the largest error is "
        f"{percent(worst.error or 0.0, signed=True)} ({worst.estimate.name})."
    ]


def _validation(steps: Sequence[StepRow]) -> list[str]:
    rows = [row for row in steps if row.role is Role.VALIDATION]
    if not rows:
        return []
    parts = [
        f"the {COORDINATE_WORDS.get(row.floor.coordinate, row.floor.coordinate)} with an NRMSE of "
        f"{percent(row.floor.nrmse)}"
        for row in rows
    ]
    return [
        f"On the lane change, which the fit has not seen, the model meets {' and '.join(parts)} "
        "(rms error over rms signal, outside of stiction)."
    ]


def _exact_inertia(identification: Identification) -> list[str]:
    if identification["B_w"].std > 0:
        return []
    return ["B_w was given without uncertainty: the intervals of m_ch, C_ch, C_l and C_r are too narrow by its share."]


def _unrepeated(steps: Sequence[StepRow]) -> list[str]:
    steps_without = [row.floor.step for row in steps if row.role is Role.FIT and not row.floor.noise >= 0]
    if not steps_without:
        return []
    return [f"No repeated periods in {', '.join(steps_without)}: noise and model error cannot be separated there."]


def _not_validated(steps: Sequence[StepRow]) -> list[str]:
    if any(row.role is Role.VALIDATION for row in steps):
        return []
    return ["No lane change in the record: nothing outside of the fit has been checked."]
