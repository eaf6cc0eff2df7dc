"""What happens while an axis may stick says nothing in its rows; what happens elsewhere keeps all it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

from hil.exam.sources.machine import Machine
from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.axis.reference import axis_reference, axis_signals, own_columns
from ident.diagnosis.axis.reversals import Sticking, Untold, untold_while_sticking
from ident.diagnosis.names import EffectName
from ident.diagnosis.observations.delays import sprung
from ident.estimate.filters import zero_phase
from ident.records.axis_record import AxisRecord

Array = NDArray[np.float64]

SAMPLES, SAMPLE_TIME, CUTOFF = 4000, 1e-3, 60.0
TIME = SAMPLE_TIME * np.arange(SAMPLES)

MACHINE = Machine(mass=25.0, coulomb=25.0, rate=500.0, substeps=8, repeats=1, duration=30.0, strokes=30, travel=0.15)


def filtered(values: Array) -> Array:
    return zero_phase(values, CUTOFF, SAMPLE_TIME)


def sticking_at(*stretches: tuple[int, int]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Where it sticks, and the rows that are used: all but those within four time constants."""
    sticking = np.zeros(SAMPLES, dtype=bool)
    for first, last in stretches:
        sticking[first:last] = True
    guard = round(4 / (CUTOFF * SAMPLE_TIME))
    return sticking, ~ndimage.binary_dilation(sticking, np.ones(2 * guard + 1, dtype=bool))


def untold(*stretches: tuple[int, int], friction: float = 30.0) -> tuple[Untold, NDArray[np.bool_]]:
    where, moving = sticking_at(*stretches)
    sticking = Sticking(where, friction, noise=1e-3, blur=2.0, ends=0.0)
    return untold_while_sticking(sticking, moving, filtered, 1 / (CUTOFF * SAMPLE_TIME)), moving


@given(st.floats(1, 50), st.integers(1000, 1009), st.integers(2500, 2529))
def test_a_friction_that_turns_at_another_moment_says_nothing(step: float, first: int, second: int) -> None:
    told, moving = untold((1000, 1010), (2500, 2530))
    turned, supposed = (
        step * ((at[0] <= np.arange(SAMPLES)) & (np.arange(SAMPLES) < at[1])) for at in ((first, second), (1005, 2515))
    )
    difference = filtered(np.asarray(turned - supposed))
    left = told.without(difference)[moving]
    assert np.abs(left).max() <= 0.2 * np.abs(difference[moving]).max()


def test_no_more_is_taken_out_than_friction_can_make() -> None:
    told, moving = untold((1000, 1010), friction=1e-6)
    series = filtered(np.where(np.arange(SAMPLES) < 1005, 0.0, 1.0))
    assert told.without(series)[moving] == pytest.approx(series[moving], abs=1e-4)


def test_what_happens_elsewhere_keeps_nearly_all_it_says() -> None:
    told, moving = untold((1000, 1010), (2500, 2530))
    series = filtered(np.sin(7 * TIME) + np.where(TIME > 1.8, 1.0, 0.0))
    kept = told.without(series)[moving]
    assert np.linalg.norm(kept) > 0.99 * np.linalg.norm(series[moving])


def test_an_axis_that_never_sticks_loses_nothing() -> None:
    told, _ = untold()
    series = filtered(np.sin(7 * TIME))
    assert np.array_equal(told.without(series), series)


def seeming_spring(record: AxisRecord, cutoff: float, bandwidth: float) -> float:
    """Compliance times M over T², of a spring far above the band, by least squares in the rows of an axis."""
    signals = axis_signals(record, cutoff, bandwidth, axis_reference([record], cutoff=cutoff).scales)
    columns, effort = signals.equations(0)
    motion, mass = signals.motions[0], float(np.linalg.lstsq(columns, effort, rcond=None)[0][0])
    spring = sprung(motion.linear[:, 0], 20 * bandwidth, record.sample_time)
    slope = signals.rows_of(0, np.gradient(own_columns(signals.motions, 0)[:, 0]))[motion.moving]
    row = signals.rows_of(0, mass * mass * spring)[motion.moving]
    found = np.linalg.lstsq(np.column_stack([columns, slope, row]), effort, rcond=None)[0]
    return float(found[-1] * mass / record.sample_time**2)


@pytest.mark.parametrize("read", [0.0, 0.25, 0.75])
@pytest.mark.parametrize("coulomb", [1.0, 40.0])
def test_a_stiff_axis_seems_as_soft_as_the_hold_of_its_effort_makes_it(read: float, coulomb: float) -> None:
    """1 - (ωT)²/24, of the sinc that holds an effort over a sample interval; dry friction adds little to it."""
    machine = replace(MACHINE, coulomb=coulomb, read=read, noise=1e-9, encoder=1e-12)
    assert seeming_spring(machine.drive(3), 250.0, 100.0) == pytest.approx(1 / 24, abs=0.03)


def test_a_spring_beside_much_dry_friction_has_its_size() -> None:
    compliance = 1e-6
    machine = replace(MACHINE, compliance=compliance / MACHINE.share**2)
    (cause,) = diagnose_axis([machine.drive(31)], [machine.drive(32)], seed=1).causes
    assert cause.candidate.effect == EffectName.ELASTICITY
    assert abs(cause.part.values[0] - compliance) < 3 * cause.part.std[0]
