"""Timers of simulated time: order, cancelling, and a heap that does not fill with what will never run."""

from __future__ import annotations

import gc

from hypothesis import given
from hypothesis import strategies as st

from emulator.firmware.timers import Timers

DELAYS = st.lists(st.integers(0, 1000), min_size=1, max_size=40)


@given(DELAYS)
def test_they_run_in_the_order_of_their_instants_and_then_of_their_setting(delays: list[int]) -> None:
    timers, ran = Timers(), []
    for number, delay in enumerate(delays):
        timers.after(delay * 1e-3, lambda number=number: ran.append((timers.now, number)))
    timers.run_until(2.0, lambda _: None)
    assert ran == sorted((round(delay * 1e-3, 9), number) for number, delay in enumerate(delays))


@given(DELAYS, st.data())
def test_a_cancelled_one_never_runs(delays: list[int], data: st.DataObject) -> None:
    timers, ran = Timers(), []
    made = [timers.after(delay * 1e-3, lambda k=k: ran.append(k)) for k, delay in enumerate(delays)]
    cancelled = data.draw(st.sets(st.sampled_from(range(len(made)))))
    for number in cancelled:
        made[number].cancel()
        made[number].cancel()
    timers.run_until(2.0, lambda _: None)
    assert sorted(ran) == sorted(set(range(len(made))) - cancelled)
    assert timers.next_event() == float("inf")


def test_the_world_is_moved_to_the_instant_of_each_timer_before_it_runs() -> None:
    timers, moved, seen = Timers(), [], []
    for delay in (0.3, 0.1):
        timers.after(delay, lambda: seen.append(moved[-1]))
    timers.run_until(0.5, moved.append)
    assert moved == [0.1, 0.3, 0.5]
    assert seen == [0.1, 0.3]


def test_a_timer_may_set_and_cancel_others() -> None:
    timers, ran = Timers(), []
    later = timers.after(0.2, lambda: ran.append("later"))

    def act() -> None:
        later.cancel()
        timers.after(0.0, lambda: ran.append("at once"))

    timers.after(0.1, act)
    timers.run_until(1.0, lambda _: None)
    assert ran == ["at once"]


def test_timers_that_are_set_and_cancelled_for_ever_fill_no_memory() -> None:
    timers = Timers()
    keep = [timers.after(100.0, lambda: None) for _ in range(10)]
    gc.collect()
    before = len(gc.get_objects())
    for _ in range(20_000):
        timers.after(60.0, lambda: None).cancel()
    gc.collect()
    assert len(gc.get_objects()) < before + 2_000
    assert timers.next_event() == keep[0].due
