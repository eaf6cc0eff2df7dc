"""A series that was taken from the rows costs what a channel of its band and noise can carry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.noise.colours import Colours
from ident.diagnosis.noise.information import information_in
from ident.diagnosis.problem import Channel, Problem

Array = NDArray[np.float64]
Asked = Callable[[Problem, Problem], Any]

SAMPLES = 800
REPEATS = 4


@pytest.fixture
def problems(world: Callable[..., Any]) -> tuple[Problem, Problem]:
    made = world(4, samples=SAMPLES, repeats=REPEATS)
    return made.problem(0), made.problem(1)


@pytest.fixture
def colours(problems: tuple[Problem, Problem], asked: Asked) -> Colours:
    found: Colours = asked(*problems).colours
    return found


def capacity(size: float, problem: Problem) -> float:
    """T times the integral of ln(1 + S/N) over the band (Shannon 1948) of the first coordinate [nat].

    S is that of a process of some size that is white up to the cutoff, N that of the noise of those worlds: an
    autoregression of unit variance, the mean of its repeats.
    """
    block, memory = problem.blocks[0], 0.8
    frequency = np.linspace(0.0, block.bandwidth / (2 * np.pi), 2001)
    signal = size**2 / frequency[-1]
    turned = np.abs(1 - memory * np.exp(-2j * np.pi * frequency * block.sample_time)) ** 2
    noise = 2 * block.sample_time * (1 - memory**2) / turned / REPEATS
    return SAMPLES * block.sample_time * float(np.trapezoid(np.log1p(signal / noise), frequency))


def in_rows(colours: Colours, size: float, part: float = 1.0, block: int = 0) -> Array:
    """A series of some size in the first rows of a block."""
    series, place = np.zeros(len(colours.rows)), colours.places[block]
    series[place.start : place.start + round(part * (place.stop - place.start))] = size
    return series


@pytest.mark.parametrize("size", [0.5, 3.0, 20.0])
def test_it_is_the_capacity_of_a_gaussian_channel(
    size: float, problems: tuple[Problem, Problem], colours: Colours
) -> None:
    assert information_in(in_rows(colours, size), colours) == pytest.approx(capacity(size, problems[0]), rel=0.1)


def test_nothing_costs_nothing_and_a_sign_makes_no_difference(colours: Colours) -> None:
    series = in_rows(colours, 3.0)
    flipped = series * np.where(np.arange(len(series)) % 40 < 20, 1.0, -1.0)
    assert information_in(np.zeros_like(series), colours) == 0.0
    assert information_in(flipped, colours) == pytest.approx(information_in(series, colours))


def test_what_is_there_half_of_the_time_has_half_of_the_numbers(colours: Colours) -> None:
    whole, half = (information_in(in_rows(colours, 3.0, part), colours) for part in (1.0, 0.5))
    assert half == pytest.approx(whole / 2, rel=0.1)


def test_both_records_count_and_of_channels_the_one_that_tells_more(
    problems: tuple[Problem, Problem], asked: Asked
) -> None:
    """The rolling rows and those of the forces are moved by the same numbers."""
    channels = (Channel.DYNAMIC, Channel.KINEMATIC)
    apart = [
        replace(one, blocks=tuple(replace(block, channel=own) for block, own in zip(one.blocks, channels, strict=True)))
        for one in problems
    ]
    colours: Colours = asked(*apart).colours
    labels = [colours.rows.blocks[number][0].channel for number in range(4)]
    fit, confirm = (np.flatnonzero([label == Channel.KINEMATIC for label in labels])).tolist()
    dynamic = labels.index(Channel.DYNAMIC)
    large, again, small = (
        in_rows(colours, *made) for made in ((3.0, 1.0, fit), (3.0, 1.0, confirm), (1.0, 1.0, dynamic))
    )
    assert information_in(large + again, colours) == pytest.approx(
        information_in(large, colours) + information_in(again, colours)
    )
    assert information_in(large + small, colours) == pytest.approx(information_in(large, colours))
