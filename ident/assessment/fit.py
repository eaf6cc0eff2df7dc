"""What the fit leaves: beside the signal, beside the noise, from repeat to repeat, and in the lane change."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.assessment.verdict import Reason, ReasonCode, Verdict
from ident.estimate.equations import Equations
from ident.estimate.identify import FIT_STEPS, VALIDATION_STEPS
from ident.estimate.noise import NoiseFloor
from ident.estimate.result import Identification
from ident.records.repeats import repeats_of

Array = NDArray[np.float64]

NRMSE_LIMITS: Final = {"x": 0.05, "alpha_v": 0.15}
"""Largest NRMSE of a lane change that counts as validated, drive force and steering torque."""

COORDINATE_WORDS: Final = {"x": "drive force", "alpha_v": "steering torque"}

NOT_BETTER: Final = 1.0
"""NRMSE with which a model says no more than that there is no torque at all."""

POOR_FIT: Final = 0.15
"""NRMSE of a fitted step: what is left then is a tenth of a per cent of the power on sound campaigns, 2 % here."""

NO_FIT: Final = 0.5
"""NRMSE of a fitted step whose model leaves a quarter of the power."""

NEGLIGIBLE: Final = 1e-3
"""Residual over signal that is below every other doubt: filters leave as much on records without noise."""

DRIFT_SHARE: Final = 0.5
"""Share of the power of the residual that goes away when parameters may change with time: beyond, what differs between
repeats is mostly another vehicle from repeat to repeat, not noise."""

RANK: Final = 1e-6
"""Columns below this share of the largest singular value are not excited."""


def fit_reasons(identification: Identification) -> Iterator[Reason]:
    """What speaks against the model as a description of its own steps, and of the lane change."""
    for equations, floor in zip(identification.equations, identification.floors, strict=True):
        if floor.step in VALIDATION_STEPS:
            yield from _held_out(floor)
        elif floor.step in FIT_STEPS:
            yield from _fitted(floor)
            yield from _repeated(floor)
            if floor.residual > NEGLIGIBLE * floor.signal:
                yield from _drifting(equations)


def _held_out(floor: NoiseFloor) -> Iterator[Reason]:
    limit = NRMSE_LIMITS[floor.coordinate]
    if floor.nrmse <= limit:
        return
    text = (
        f"The {COORDINATE_WORDS[floor.coordinate]} of the lane change, which the fit has not seen, is off by "
        f"{100 * floor.nrmse:.3g} % NRMSE (limit {100 * limit:g} %)."
    )
    verdict = Verdict.UNUSABLE if floor.nrmse > NOT_BETTER else Verdict.DOUBTFUL
    yield Reason(ReasonCode.HELD_OUT, _place(floor), floor.nrmse, limit, text, verdict)


def _fitted(floor: NoiseFloor) -> Iterator[Reason]:
    if floor.nrmse <= POOR_FIT:
        return
    text = f"In {floor.step} the fitted model is off by {100 * floor.nrmse:.3g} % NRMSE: it is not what moves there."
    verdict = Verdict.UNUSABLE if floor.nrmse > NO_FIT else Verdict.DOUBTFUL
    yield Reason(ReasonCode.DOES_NOT_FIT, _place(floor), floor.nrmse, POOR_FIT, text, verdict)


def _repeated(floor: NoiseFloor) -> Iterator[Reason]:
    if not floor.model_error > max(floor.noise, NEGLIGIBLE * floor.signal):
        return
    text = (
        f"In {floor.step}, what repeats from period to period ({floor.model_error:.3g} {floor.unit} rms) exceeds the "
        f"noise ({floor.noise:.3g} {floor.unit} rms): the model leaves something out there that more periods will not "
        "average out. The intervals account for it."
    )
    ratio = floor.model_error / floor.noise if floor.noise > 0 else np.inf
    yield Reason(ReasonCode.MODEL_ERROR, _place(floor), float(ratio), 1.0, text, Verdict.DOUBTFUL)


def _drifting(equations: Equations) -> Iterator[Reason]:
    share = drift_share(equations)
    if not share > DRIFT_SHARE:
        return
    text = (
        f"In {equations.step}, {100 * share:.0f} % of what the model leaves goes away when parameters "
        "may change with time: the vehicle changed from repeat to repeat (warming, slip, a load that moved)."
    )
    place = f"{equations.step}.{equations.coordinate}"
    yield Reason(ReasonCode.REPEATS_DIFFER, place, share, DRIFT_SHARE, text, Verdict.DOUBTFUL)


def drift_share(equations: Equations) -> float:
    """Share of the power of a step's residual that parameters with a trend explain [-]; NaN where nothing repeats.

    The rows are fitted by parameters of the step's own, then by parameters that change with time in a parabola. Noise
    of whatever colour gives a trend little: a few directions among all that the repeats span.

    Args:
        equations: rows of one coordinate of one step.
    """
    if len(repeats_of(equations.period)) < 2 or not equations.moving.any():
        return float("nan")
    rows = equations.moving
    norms = np.linalg.norm(equations.regressor[rows], axis=0)
    theta = equations.regressor[rows][:, norms > 0] / norms[norms > 0]
    time = equations.time[rows]
    course = (time - time.mean()) / max(float(np.ptp(time)) / 2, np.finfo(float).tiny)
    fixed = _left(theta, equations.torque[rows])
    drifting = _left(np.hstack([theta, theta * course[:, None], theta * course[:, None] ** 2]), equations.torque[rows])
    return 1 - drifting / fixed if fixed > 0 else float("nan")


def _left(columns: Array, values: Array) -> float:
    """Power that a fit leaves."""
    found = np.linalg.lstsq(columns, values, rcond=RANK)[0]
    return float(np.sum((values - columns @ found) ** 2))


def _place(floor: NoiseFloor) -> str:
    return f"{floor.step}.{floor.coordinate}"
