"""The randomness of the emulator: one seed, one history, however many steps are drawn at once."""

from __future__ import annotations

import math

import numpy as np
import pytest

from emulator import noise
from emulator.noise import Disturbances, OrnsteinUhlenbeck, WhiteNoise
from emulator.prototype import load_prototype

STEP = 0.001
MEMORY = 0.05
"""Correlation time [s]."""


def history(steps: int) -> list[list[float]]:
    drawn = Disturbances(load_prototype(), seed=3, scale=1.0, step=STEP)
    rows = []
    for _ in range(steps):
        rows.append([*drawn.torque_reading, *drawn.motor_dither, *drawn.steering_dither, *drawn.load])
        drawn.advance()
    return rows


def test_how_many_steps_are_drawn_at_once_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = history(2500)
    for block in (1, 7, 1024):
        monkeypatch.setattr(noise, "BLOCK", block)
        assert history(2500) == usual


def test_who_is_stopped_while_numbers_are_drawn_goes_on_from_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C comes at any place; what follows it brings the drives to rest."""
    monkeypatch.setattr(noise, "BLOCK", 2)
    drawn = Disturbances(load_prototype(), seed=3, scale=1.0, step=STEP)
    draw = OrnsteinUhlenbeck.draw

    def stopped(self: OrnsteinUhlenbeck, steps: int) -> None:
        monkeypatch.setattr(OrnsteinUhlenbeck, "draw", draw)
        raise KeyboardInterrupt

    drawn.advance()
    monkeypatch.setattr(OrnsteinUhlenbeck, "draw", stopped)
    with pytest.raises(KeyboardInterrupt):
        drawn.advance()
    for _ in range(3):
        drawn.advance()
    assert len(drawn.load) == 8


def test_correlated_noise_is_the_recursion_that_it_is_said_to_be() -> None:
    scales = np.array([1.0, 0.3])
    drawn = OrnsteinUhlenbeck(np.random.default_rng(5), scales, step=STEP, correlation_time=MEMORY)
    rows = np.vstack([drawn.draw(steps) for steps in (1, 500, 3)])
    white = WhiteNoise(np.random.default_rng(5), scales)
    rho = math.exp(-STEP / MEMORY)
    last = white.draw(1)[0]
    for row in rows:
        last = rho * last + math.sqrt(1 - rho**2) * white.draw(1)[0]
        assert row == pytest.approx(last, rel=1e-12)


def test_correlated_noise_has_the_size_and_the_memory_that_were_asked_for() -> None:
    drawn = OrnsteinUhlenbeck(np.random.default_rng(6), np.array([2.0]), step=STEP, correlation_time=MEMORY)
    rows = drawn.draw(400_000)[:, 0]
    assert rows.std() == pytest.approx(2.0, rel=0.03)
    lag = round(MEMORY / STEP)
    assert np.corrcoef(rows[:-lag], rows[lag:])[0, 1] == pytest.approx(math.exp(-1), abs=0.03)
