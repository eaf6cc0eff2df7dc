"""From position and effort of an axis to rows of its model, as published for the EMPS benchmark.

A. Janot, M. Gautier, M. Brunot: Data Set and Reference Models of EMPS, Workshop on Nonlinear System Identification
Benchmarks, 2019. Filters run forwards and backwards with the edges reflected over 3 (n - 1) samples, n the length of
the coefficient vectors, as MATLAB's `filtfilt` does; every printed digit of the publication depends on that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from ident.errors import EstimationError
from ident.estimate.axis.cutoff import position_cutoff
from ident.estimate.filters import butterworth, differentiate
from ident.records.axis_record import AxisRecord, AxisSignals

Array = NDArray[np.float64]

BUTTERWORTH_ORDER: Final = 4
CHEBYSHEV_ORDER: Final = 8
CHEBYSHEV_RIPPLE: Final = 0.05
"""Pass-band ripple of the decimation filter [dB]."""
CHEBYSHEV_EDGE: Final = 0.8
"""Pass-band edge of the decimation filter over the new Nyquist frequency."""

LEAST_BAND: Final = 20.0
"""Cutoff of the position filter at least, times the duration [Hz s]."""
ROWS_PER_PERIOD: Final = 2.5
"""Rows that are left of a period of the cutoff frequency, more than the two that show it."""

PARAMETERS: Final = ("M", "Fv", "Fc", "offset")
"""Of the model M a + Fv v + Fc sign(v) + offset = effort."""


@dataclass(frozen=True)
class AxisProcessing:
    """How a record of an axis becomes equations; the defaults are those published for EMPS.

    Attributes:
        cutoff: of the zero-phase Butterworth filter on the position [rad/s].
        skip: samples dropped at the start, where the filter has not settled.
        decimation: every how many samples a row is taken, behind a zero-phase Chebyshev filter; 1 takes all.
    """

    cutoff: float = 2 * math.pi * 100
    skip: int = 49
    decimation: int = 10


def processing_for(record: AxisRecord, cutoff: float | None = None) -> AxisProcessing:
    """How a record of any rate becomes equations: filtered where its noise begins, thinned to that.

    Args:
        record: of any axes.
        cutoff: of the position filter [rad/s]; None: from the record.
    """
    chosen = cutoff or position_cutoff(record, LEAST_BAND)
    factor = max(1, int(2 * math.pi / (ROWS_PER_PERIOD * chosen * record.sample_time)))
    return AxisProcessing(chosen, round(2 * math.pi / (chosen * record.sample_time)), factor)


@dataclass(frozen=True)
class AxisEquations:
    """Filtered and decimated rows of one axis.

    Attributes:
        sample_time: between rows [s].
        time: (M,) [s].
        regressor: (M, 4), columns in the order of PARAMETERS.
        effort: (M,) [N or Nm].
        period: (M,) number of the repeat, -1 outside of any.
    """

    sample_time: float
    time: Array
    regressor: Array
    effort: Array
    period: NDArray[np.int64]


def axis_equations(record: AxisRecord, axis: AxisSignals, processing: AxisProcessing) -> AxisEquations:
    """Rows of the model; the columns and the effort pass the same decimation filter.

    Raises:
        EstimationError: the record is too short for the filters, or sampled too slowly for the cutoff.
    """
    _check(record, processing)
    dt = record.sample_time
    velocity = differentiate(smoothed(axis.position, processing.cutoff, dt), dt)
    acceleration = differentiate(velocity, dt)
    columns = (acceleration, velocity, np.sign(velocity), np.ones_like(velocity), axis.effort)
    table = decimated(np.stack(columns, axis=1)[processing.skip :], processing.decimation)
    rows = kept_rows(len(record) - processing.skip, processing.decimation)
    return AxisEquations(
        sample_time=dt * processing.decimation,
        time=record.time[processing.skip :][rows],
        regressor=table[:, :-1],
        effort=table[:, -1],
        period=record.period[processing.skip :][rows],
    )


def smoothed(position: Array, cutoff: float, sample_time: float) -> Array:
    """4th-order Butterworth low-pass forwards and backwards along axis 0, cutoff in rad/s."""
    return _both_ways(butterworth(BUTTERWORTH_ORDER, cutoff, sample_time), position, BUTTERWORTH_ORDER)


def decimated(values: Array, factor: int) -> Array:
    """Every `factor`-th row behind an 8th-order Chebyshev-I low-pass, run forwards and backwards."""
    if factor == 1:
        return values
    sections = signal.cheby1(CHEBYSHEV_ORDER, CHEBYSHEV_RIPPLE, CHEBYSHEV_EDGE / factor, output="sos")
    return _both_ways(sections, values, CHEBYSHEV_ORDER)[kept_rows(len(values), factor)]


def kept_rows(samples: int, factor: int) -> slice:
    """Rows that decimation keeps: the last one, and every `factor`-th before it."""
    return slice((samples - 1) % factor, None, factor)


def _both_ways(sections: Array, values: Array, order: int) -> Array:
    return np.asarray(signal.sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=3 * order))


def _check(record: AxisRecord, processing: AxisProcessing) -> None:
    rows = len(record) - processing.skip
    needed = max(3 * CHEBYSHEV_ORDER + 1, processing.decimation * 5 * len(PARAMETERS))
    if rows < needed:
        raise EstimationError(
            f"{record.source} holds {len(record)} samples, {rows} after the first {processing.skip} are dropped.",
            f"The filters need {needed} of them; record longer, or lower the decimation.",
        )
    nyquist = math.pi / record.sample_time
    if processing.cutoff >= nyquist:
        raise EstimationError(
            f"{record.source} is sampled every {record.sample_time * 1e3:.3g} ms, too slowly for a filter of "
            f"{processing.cutoff:.4g} rad/s.",
            f"Set the cutoff below {nyquist:.4g} rad/s, or sample faster.",
        )
