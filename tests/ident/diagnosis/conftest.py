"""Worlds whose gap is known: regressions drawn at random, and machines simulated from textbook physics.

The machines know nothing of the candidates (`hil.exam.sources.machine`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal
from threadpoolctl import threadpool_limits

from hil.exam.sources.machine import Machine
from ident.diagnosis.hypotheses.hypotheses import Design
from ident.diagnosis.hypotheses.products import Products
from ident.diagnosis.noise.colours import Colours
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.problem import Block, Candidate, Channel, Problem, Variant
from ident.diagnosis.search.asked import asked_of
from ident.diagnosis.search.search import Search
from ident.effects import EffectParameter

Array = NDArray[np.float64]

RATE = 50.0
BANDWIDTH = 40.0


def coloured(generator: np.random.Generator, shape: tuple[int, ...], memory: float = 0.8) -> Array:
    """Noise of unit variance whose neighbours are correlated, along axis 0."""
    white = generator.normal(size=(shape[0] + 200, *shape[1:]))
    return np.asarray(signal.lfilter([np.sqrt(1 - memory**2)], [1, -memory], white, axis=0)[200:])


@dataclass(frozen=True)
class World:
    """A regression: p baseline columns, some candidates of one column, two coordinates."""

    seed: int
    names: tuple[str, ...] = ("a", "b", "c", "d", "e", "f")
    repeats: int = 4
    samples: int = 800
    true: Mapping[str, float] = field(default_factory=dict)
    hidden: float = 0.0
    alike: Mapping[str, str] = field(default_factory=dict)

    def problem(self, part: int) -> Problem:
        """`part` 0 to fit, 1 to confirm: other motion, other noise, the same truth."""
        motion = np.random.default_rng([self.seed, part, 0])
        noise = np.random.default_rng([self.seed, part, 1])
        blocks, columns = [], []
        for coordinate in ("x", "y"):
            baseline = self._repeated(motion, 3)
            own = {name: self._repeated(motion, 1) for name in self.names}
            own |= {name: own[other] for name, other in self.alike.items()}
            state = self._repeated(motion, 1)
            target = baseline @ np.array([1.0, -2.0, 0.5]) + coloured(noise, (len(baseline),))
            target = target + sum(size * own[name][:, 0] for name, size in self.true.items())
            target = target + self.hidden * np.sin(4 * state[:, 0])
            period = np.repeat(np.arange(self.repeats), self.samples).astype(np.int64)
            blocks.append(
                Block(
                    record=f"part {part}",
                    channel=Channel.DYNAMIC,
                    step="step",
                    coordinate=coordinate,
                    unit="Nm",
                    sample_time=1 / RATE,
                    bandwidth=BANDWIDTH,
                    target=target,
                    baseline=baseline,
                    moving=np.ones(len(target), dtype=bool),
                    period=period,
                    regions={"first_half": np.arange(len(target)) % self.samples < self.samples // 2},
                    features=state,
                )
            )
            columns.append(own)
        candidates = tuple(
            Candidate(name, "place", (EffectParameter("size", "Nm", ""),), (Variant(tuple(o[name] for o in columns)),))
            for name in self.names
        )
        return Problem(("p", "q", "r"), ("kg", "kg", "kg"), tuple(blocks), candidates)

    def _repeated(self, generator: np.random.Generator, width: int) -> Array:
        return np.tile(coloured(generator, (self.samples, width), 0.9), (self.repeats, 1))


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> Iterator[None]:
    """What the callers of `judge` see to."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield


@pytest.fixture
def world() -> type[World]:
    return World


@pytest.fixture
def machine() -> Callable[..., Machine]:
    return Machine


@dataclass(frozen=True)
class Question:
    """What the posterior is computed from."""

    regression: Regression
    colours: Colours
    design: Design
    products: Products
    search: Search

    def number(self, key: str) -> int:
        """Of a hypothesis."""
        return next(index for index, one in enumerate(self.design.hypotheses) if one.key == key)


def _asked(fit: Problem, confirm: Problem) -> Question:
    made = asked_of((fit, confirm))
    colours, every = Colours(made.regression), np.arange(made.design.columns.shape[1])
    return Question(made.regression, colours, made.design, Products(made.design, colours, every), Search(made.fitter))


@pytest.fixture
def asked() -> Callable[[Problem, Problem], Question]:
    return _asked
