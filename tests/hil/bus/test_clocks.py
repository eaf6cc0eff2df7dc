"""Simulated and wall time mean the same to a master."""

from __future__ import annotations

from hil.bus.clock import FreeRunningClock, SimulatedClock, WallClock


class Quartz:
    """An operating system's clock that moves only by sleeping and by being looked at."""

    def __init__(self) -> None:
        self.seconds = 100.0
        self.oversleeps = 0.0

    def monotonic(self) -> float:
        self.seconds += 1e-6
        return self.seconds

    def unix(self) -> float:
        return self.seconds + 1.7e9

    def sleep(self, duration: float) -> None:
        self.seconds += duration + self.oversleeps


def wall_clock(quartz: Quartz, kind: type[WallClock] = WallClock) -> WallClock:
    return kind(0.001, quartz.monotonic, quartz.unix, quartz.sleep)


def test_simulated_time_moves_only_by_waiting_and_takes_its_world_along() -> None:
    moved: list[float] = []
    clock = SimulatedClock(moved.append)
    assert clock.now() == clock.now() == 0.0
    assert clock.wait_until(0.5) == 0.0
    assert clock.now() == 0.5
    assert moved == [0.5]


def test_waiting_for_the_past_returns_at_once_and_tells_how_late_it_is() -> None:
    clock = SimulatedClock(start=2.0)
    assert clock.wait_until(1.5) == 0.5
    assert clock.now() == 2.0


def test_wall_time_is_unix_time() -> None:
    quartz = Quartz()
    clock = wall_clock(quartz)
    assert abs(clock.now() - quartz.unix()) < 1e-4


def test_a_wait_ends_at_its_instant_and_not_before() -> None:
    quartz = Quartz()
    clock = wall_clock(quartz)
    due = clock.now() + 0.002
    assert 0.0 <= clock.wait_until(due) < 1e-4
    assert clock.now() >= due
    assert (clock.waits, clock.overruns) == (1, 0)


def test_a_computer_that_oversleeps_is_counted_as_an_overrun() -> None:
    quartz = Quartz()
    quartz.oversleeps = 0.005
    clock = wall_clock(quartz)
    for _ in range(3):
        clock.wait_until(clock.now() + 0.002)
    assert clock.overruns == 3
    assert 0.004 < clock.worst_lateness < 0.006


def test_a_free_running_clock_waits_for_nothing_and_is_never_late() -> None:
    quartz = Quartz()
    clock = wall_clock(quartz, FreeRunningClock)
    assert clock.wait_until(clock.now() + 1000.0) == 0.0
    assert clock.wait_until(0.0) == 0.0
    assert quartz.seconds < 101.0
