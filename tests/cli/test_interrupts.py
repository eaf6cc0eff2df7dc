"""Ctrl-C ends a loop, wherever in it the signal comes."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import threading
import time
from pathlib import Path

import pytest

from quasiomni.interrupts import asked_to_end
from tests.cli.test_real_time_loops import serving


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_is_asked_for_and_what_was_there_before_is_there_again(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with asked_to_end() as asked:
        assert not asked()
        os.kill(os.getpid(), number)
        assert asked()
    assert signal.getsignal(number) is before


def test_a_signal_while_garbage_is_collected_is_not_lost() -> None:
    def tell(_phase: str, _information: dict[str, int]) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        gc.callbacks.remove(tell)

    with asked_to_end() as asked:
        gc.callbacks.append(tell)
        gc.collect()
        assert asked()


def test_a_second_signal_interrupts() -> None:
    with asked_to_end():
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)


def test_a_thread_has_no_signals() -> None:
    answers: list[bool] = []

    def ask() -> None:
        with asked_to_end() as asked:
            answers.append(asked())

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    assert answers == [False]


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.1])
def test_an_emulator_ends_however_early_it_is_asked_to(tmp_path: Path, delay: float) -> None:
    with serving(f"unix:{tmp_path / 'bus'}", "--trace", str(tmp_path / "trace.csv")) as (process, _):
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        try:
            said = process.communicate(timeout=60)[0]
        except subprocess.TimeoutExpired:
            pytest.fail("it goes on")
    assert "0 cycles served" in said
    assert process.returncode == 0
