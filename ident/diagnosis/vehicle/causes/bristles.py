"""Friction of bristles that bend before they slide as a candidate: its columns, and what rows can bound of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.dependence import NEAREST, path_since_reversal
from ident.diagnosis.names import EffectName, places_of
from ident.diagnosis.problem import Candidate, Variant
from ident.diagnosis.vehicle.causes.bending import BristleCause, joint_angle
from ident.diagnosis.vehicle.causes.context import Context
from ident.diagnosis.vehicle.causes.dependences import levers_of
from ident.diagnosis.vehicle.causes.library import placed_parameters
from ident.diagnosis.vehicle.records.sources import Source

Array = NDArray[np.float64]

ANGLES: Final = (0.01, 0.03, 0.1, 0.3)
"""Over which bristles bend, tried first [rad]."""

WIDEST: Final = 1.0
"""Followed up to that [rad]; wider is a spring, as far as wheels and steering go."""


def bristle_causes() -> list[BristleCause]:
    """At all places."""
    return [BristleCause(where) for where in places_of(EffectName.PRESLIDING)]


def bristle_candidate(cause: BristleCause, sources: Sequence[Source], context: Context) -> Candidate:
    """Friction of the bristles once they slide, and the angle that they bend over."""
    acting = [levers_of(source, context) for source in sources]
    shortest = _shortest(cause, sources, acting)

    def columns(angle: float) -> list[Array | None]:
        within = float(np.clip(abs(angle), shortest, WIDEST))
        found: list[Array | None] = []
        for source, lever in zip(sources, acting, strict=True):
            found += _columns(cause, within, source, lever, context)
        return found

    def contribution(values: Array, baseline: Array) -> list[Array | None]:
        del baseline
        return [None if column is None else float(values[0]) * column for column in columns(float(values[1]))]

    def variant(angle: float) -> Variant:
        made = tuple(None if column is None else column[:, None] for column in columns(angle))
        return Variant(made, lambda found: np.append(found, angle))

    return Candidate(
        effect=EffectName.PRESLIDING,
        where=cause.where,
        parameters=placed_parameters(EffectName.PRESLIDING, cause.where),
        variants=tuple(variant(angle) for angle in (max(angle, shortest) for angle in ANGLES)),
        contribution=contribution,
        least=0.0,
        lowest=(0.0, shortest),
        price=0.5 * math.log(_used(cause, sources, acting)),
    )


def _columns(
    cause: BristleCause, angle: float, source: Source, lever: Array | None, context: Context
) -> list[Array | None]:
    """What bristles of amplitude one do in the rows of a source, (N,) each."""
    found: list[Array | None] = [None] * len(source.coordinates)
    if lever is None:
        return found
    rows = np.flatnonzero(lever[:, list(cause.joints)].any(axis=(0, 1)))
    if len(rows):
        inputs = context.inputs(source)
        bent = cause.bent(inputs, angle)
        torques = np.einsum("nj,njr->nr", bent, lever[:, list(cause.joints)][:, :, rows])
        for row, column in zip(rows.tolist(), context.in_rows(torques, source, rows.tolist()).T, strict=True):
            found[row] = column
    return found


def _used(cause: BristleCause, sources: Sequence[Source], acting: Sequence[Array | None]) -> int:
    """Samples in which its friction shows, at least one: the angle, which is fitted, costs what a number does."""
    joints = list(cause.joints)
    return max(
        sum(
            int(source.moving[row].sum())
            for source, lever in zip(sources, acting, strict=True)
            if lever is not None
            for row in np.flatnonzero(lever[:, joints].any(axis=(0, 1))).tolist()
        ),
        1,
    )


def _shortest(cause: BristleCause, sources: Sequence[Source], acting: Sequence[Array | None]) -> float:
    """Angle that the rows can bound [rad]: what is over before they begin, none of them can."""
    nearest = []
    for source, lever in zip(sources, acting, strict=True):
        for joint in cause.joints:
            rows = [] if lever is None else np.flatnonzero(lever[:, joint].any(axis=0)).tolist()
            used = np.any([source.moving[row] for row in rows], axis=0) if rows else np.zeros(1, dtype=np.bool_)
            if used.any():
                angles = joint_angle(source.inputs, joint)
                nearest.append(float(np.quantile(path_since_reversal(angles, np.gradient(angles))[used], NEAREST)))
    return min(nearest, default=WIDEST)
