"""Rows of (22): a driven segment becomes regressor, generalized torque and mask."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.estimate.filters import (
    Processing,
    differentiate,
    moving_rows,
    sliding_samples,
    smooth,
    zero_phase,
)
from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.records.checks import UNJUDGED
from ident.records.record import Segment, Step
from ident.vehicle.geometry import WHEELS, Geometry
from ident.vehicle.parameters import COULOMB_EPSILON, parameter_column

Array = NDArray[np.float64]

_BETA: Final = slice(5, 9)
_WHEEL_JOINTS: Final = (5, 6, 7, 8)


@dataclass(frozen=True)
class RowsOfStep:
    """Which rows of (19) a step contributes.

    Attributes:
        mode: k, or None for wheels in the air, which are four single axes.
        coordinates: generalized coordinates whose rows are used, by name.
        joints: indices into q whose friction acts in those rows; all must move.
    """

    mode: Mode | None
    coordinates: tuple[str, ...]
    joints: tuple[int, ...]


ROWS: Final = {
    Step.STEERING_LEFT: RowsOfStep(Mode.ALIGNMENT, ("alpha_l",), (3, 5, 6)),
    Step.STEERING_RIGHT: RowsOfStep(Mode.ALIGNMENT, ("alpha_r",), (4, 7, 8)),
    Step.STRAIGHT: RowsOfStep(Mode.STEERED, ("x",), _WHEEL_JOINTS),
    Step.ROTATION: RowsOfStep(Mode.ROTATION, ("gamma",), _WHEEL_JOINTS),
    Step.LATERAL: RowsOfStep(Mode.LATERAL, ("y",), _WHEEL_JOINTS),
    Step.LANE_CHANGE: RowsOfStep(Mode.STEERED, ("alpha_v", "x"), (3, 4, 5, 6, 7, 8)),
    Step.WHEEL_LIFTED: RowsOfStep(None, tuple(f"beta_{wheel}" for wheel in WHEELS), _WHEEL_JOINTS),
}
"""Steps that the estimator knows; segments of other names are passed over."""


@dataclass(frozen=True)
class Motion:
    """Smoothed motion of a segment.

    Attributes:
        alpha: (N, 2) [rad].
        rates, accelerations: q̇, q̈ (N, 9), chassis-frame twist first, by odometry (3).
    """

    alpha: Array
    rates: Array
    accelerations: Array


@dataclass(frozen=True)
class Equations:
    """Filtered rows Θ p = τ of one coordinate of one segment, all samples, with the mask beside them.

    Attributes:
        step, coordinate: where the rows come from.
        sample_time: [s].
        time: (N,) [s].
        regressor: (N, 11), columns in the order of (18).
        torque: (N,) generalized torque less what a known load takes [Nm or N].
        growth: (N,) of that with time [Nm/s or N/s].
        moving: (N,) rows to be used; the others are stiction.
        period: (N,) number of the repeat, -1 outside of any.
    """

    step: str
    coordinate: str
    sample_time: float
    time: Array
    regressor: Array
    torque: Array
    growth: Array
    moving: NDArray[np.bool_]
    period: NDArray[np.int64]


def motion_of(segment: Segment, geometry: Geometry, processing: Processing) -> Motion:
    """Smoothed angles, rates and accelerations of a segment; the twist by odometry (3)."""
    dt = segment.sample_time
    alpha, beta = (
        smooth(angles, processing, dt, unjudged=UNJUDGED) for angles in (segment.steering_angles, segment.wheel_angles)
    )
    twist = kinematics.odometry(alpha.angles, alpha.rates, beta.rates, geometry)
    return Motion(
        alpha.angles,
        rates=np.hstack([twist, alpha.rates, beta.rates]),
        accelerations=np.hstack([differentiate(twist, dt), alpha.accelerations, beta.accelerations]),
    )


def equations_of(
    segment: Segment, geometry: Geometry, processing: Processing, epsilon: float = COULOMB_EPSILON
) -> list[Equations]:
    """Rows that a segment contributes, one `Equations` a coordinate.

    The columns of Θ and τ pass the same zero-phase filter: a regressor built from filtered velocities would
    not be the filtered regressor, because of tanh. In stiction Θ p = τ does not hold, and the filter would spread by
    how much over the rows beside it: such samples are zero on both sides.

    Raises:
        KeyError: the segment's step is none of ROWS.
    """
    spec = ROWS[Step(segment.step)]
    motion = motion_of(segment, geometry, processing)
    theta, torque, names = _raw_rows(spec, segment, motion, geometry, epsilon)
    found = []
    for name in spec.coordinates:
        row, rates = names.index(name), motion.rates[:, _joints(spec, name)]
        found.append(_filtered(segment, name, theta[:, row], torque[:, row], rates, processing))
    return found


def _filtered(
    segment: Segment, coordinate: str, theta: Array, torque: Array, rates: Array, processing: Processing
) -> Equations:
    """Rows from unfiltered Θ (N, 11) and τ (N,), and the rates (N, n) of the joints whose friction is in them."""
    dt = segment.sample_time
    slides = sliding_samples(rates, processing, dt, processing.moving)
    return Equations(
        step=segment.step,
        coordinate=coordinate,
        sample_time=dt,
        time=segment.time,
        regressor=zero_phase(np.where(slides[:, None], theta, 0.0), processing.cutoff, dt, UNJUDGED),
        torque=zero_phase(np.where(slides, torque, 0.0), processing.cutoff, dt, UNJUDGED),
        growth=zero_phase(np.where(slides, np.gradient(torque, dt), 0.0), processing.cutoff, dt, UNJUDGED),
        moving=moving_rows(rates, processing, dt),
        period=segment.period,
    )


def _raw_rows(
    spec: RowsOfStep, segment: Segment, motion: Motion, geometry: Geometry, epsilon: float
) -> tuple[Array, Array, tuple[str, ...]]:
    if spec.mode is None:
        theta = dynamics.regressor(motion.rates, motion.accelerations, epsilon)[:, _BETA]
        return theta, geometry.gear_ratio * segment.motor_torques, spec.coordinates
    theta = dynamics.projected_regressor(spec.mode, motion.alpha, motion.rates, motion.accelerations, geometry, epsilon)
    torque = dynamics.generalized_torques(spec.mode, motion.alpha, segment.motor_torques, geometry)
    # A load over the centre moves as m_ch does; what it takes is known.
    torque = torque - segment.payload * theta[:, :, parameter_column("m_ch")]
    return theta, torque, kinematics.GENERALIZED_VELOCITIES[spec.mode]


def _joints(spec: RowsOfStep, coordinate: str) -> tuple[int, ...]:
    """Indices into q of the joints whose friction acts in the rows of one coordinate."""
    if spec.mode is None:
        return (5 + WHEELS.index(coordinate.removeprefix("beta_")),)
    return _WHEEL_JOINTS if coordinate == "x" else spec.joints


def usable_equations(segments: list[Segment], geometry: Geometry, processing: Processing) -> list[Equations]:
    """Rows of all segments whose step the estimator knows."""
    known = {str(step) for step in ROWS}
    return [
        equations
        for segment in segments
        if segment.step in known
        for equations in equations_of(segment, geometry, processing)
    ]
