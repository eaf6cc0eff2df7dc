"""500 Hz in real time, physics included: how many cycles come late, and why."""

from __future__ import annotations

import os
import sys

import pytest

from hil.bench.real_time import Measured, Trial, measure

pytestmark = pytest.mark.bench

CYCLES = 30_000
ALLOWED = 0.001
"""Share of late cycles beyond those of a loop that only sleeps."""
BUSY = 0.7
"""Load of the machine, in processes that want a core, from which on lateness says nothing about us."""


def refuse_busy() -> None:
    load = os.getloadavg()[0]
    if load > BUSY:
        pytest.skip(f"the machine is busy (load {load:.1f}): lateness would be that of other programs")


def shown(measured: Measured) -> str:
    """Figures of a run, on some lines."""
    bare, bench = measured.shares
    within = "; ".join(
        f"{100 * share:g} % within {1e3 * of_bare:.2f} and {1e3 * of_bench:.2f} ms"
        for share, of_bare, of_bench in measured.quantiles()
    )
    reasons = ", ".join(f"{count} x {reason}" for reason, count in measured.reasons.most_common())
    return (
        f"\n{len(measured.bench)} cycles, {measured.urgency.what}, load of the machine {measured.load:.2f}: later than "
        f"1 ms {bare:.3%} of a loop that only sleeps, {bench:.3%} of the bench\n{within}\n{reasons}"
    )


def test_at_500_hz_with_physics_hardly_a_cycle_is_late_that_a_bare_loop_would_not_be(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A cycle is late when its last TPDO comes more than 1 ms after the instant at which it comes undisturbed."""
    refuse_busy()
    measured = measure(Trial((sys.executable, "-m", "quasiomni", "emulate"), CYCLES))
    with capsys.disabled():
        print(shown(measured))
    assert measured.unexplained == 0
    bare, bench = measured.shares
    assert bench - bare <= ALLOWED


def test_without_priority_every_late_cycle_has_a_reason_too(capsys: pytest.CaptureFixture[str]) -> None:
    """For the comparison: how many there are is the machine's."""
    refuse_busy()
    command = (sys.executable, "-m", "quasiomni", "emulate", "--no-priority")
    measured = measure(Trial(command, CYCLES // 3, priority=False))
    with capsys.disabled():
        print(shown(measured))
    assert measured.unexplained == 0
    assert not measured.urgency.given
