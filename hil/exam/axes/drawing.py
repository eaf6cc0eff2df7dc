"""Draws the cases of an exam of axes: what is missing and how large, then a machine for each, and the size on it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from hil.exam.axes.effects import LAWS, MISSING, NAMED, PLACE, machine_with
from hil.exam.axes.sizes import ruler_of
from hil.exam.cases import SIZES, Case, Injected, Kind
from hil.exam.drawing import LAW_SIZES, Composition, identifiers_of
from hil.exam.lots import Lots
from hil.exam.sources.axes import draw_machine, reach_of
from hil.exam.sources.machine import Machine
from ident.errors import EstimationError, UserError

Spread = Callable[[Callable[..., Case], Iterable[tuple[Any, ...]]], Iterator[Case]]
"""Runs a function over tasks."""

TRAVELS: Final = (0.5, 1.5)
"""Travel of a machine over the length of a stroke, which others can be as long as."""

LARGEST: Final = 2.0
"""Sizes over those that machines have, at most: a motion that shows less of it asks nothing."""

MACHINES: Final = 20
"""Machines that are drawn at most until one can be driven with what a case asks."""


@dataclass(frozen=True)
class Question:
    """What a case asks, before there is a machine: names, their size in noise units, and its signs."""

    kind: Kind
    names: tuple[str, ...] = ()
    units: float = 0.0
    signs: tuple[float, ...] = ()


def draw_axis_cases(composition: Composition, lots: Lots, spread: Spread) -> list[Case]:
    """Cases in shuffled order.

    Args:
        composition: how many of which kind.
        lots: of everything that is drawn.
        spread: runs the sizing of cases side by side.

    Raises:
        UserError: a kind is asked for that axes do not have.
    """
    _refuse_strange(composition)
    generator = lots.questions
    questions = [
        *_singles(composition.effects, generator),
        *_pairs(composition.pairs, generator),
        *(Question(Kind.NONE) for _ in range(composition.none)),
        *_laws(composition.laws, generator),
    ]
    order = generator.permutation(len(questions)).tolist()
    identifiers = identifiers_of(len(questions), lots.identifiers)
    tasks = [
        (questions[place], name, lots.noise(number))
        for number, (place, name) in enumerate(zip(order, identifiers, strict=True))
    ]
    found = {case.identifier: case for case in spread(sized_case, tasks)}
    return [found[identifier] for identifier in identifiers]


def _refuse_strange(composition: Composition) -> None:
    asked = [str(kind) for kind in (Kind.UNKNOWN, Kind.INVISIBLE, Kind.FAULT) if composition.asked[kind]]
    if asked:
        raise UserError(
            f"An exam of axes has no cases of the kind {asked[0]}.",
            "Ask for none: --unknown 0 --invisible 0 --faults 0.",
        )


def _singles(count: int, generator: np.random.Generator) -> Iterator[Question]:
    """Names in turn; each runs through the sizes."""
    for number in range(count):
        turn, place = divmod(number, len(NAMED))
        units = SIZES[-1] if MISSING[NAMED[place]].as_met else SIZES[(turn + place) % len(SIZES)]
        yield _question(Kind.EFFECT, (NAMED[place],), units, generator)


def _pairs(count: int, generator: np.random.Generator) -> Iterator[Question]:
    both = list(itertools.combinations(NAMED, 2))
    for place in generator.permutation(len(both) * (1 + count // len(both)))[:count].tolist():
        yield _question(Kind.PAIR, both[place % len(both)], SIZES[-1], generator)


def _laws(count: int, generator: np.random.Generator) -> Iterator[Question]:
    for number in range(count):
        units = float(generator.uniform(*LAW_SIZES))
        yield _question(Kind.LAW, (LAWS[number % len(LAWS)],), units, generator)


def _question(kind: Kind, names: tuple[str, ...], units: float, generator: np.random.Generator) -> Question:
    signs = (float(generator.choice([-1.0, 1.0])) if MISSING[name].signed else 1.0 for name in names)
    return Question(kind, names, units, tuple(signs))


def sized_case(question: Question, identifier: str, seed: int) -> Case:
    """A case with the sizes of what its machine lacks; runs in a worker.

    Args:
        question: what it asks.
        identifier: of the case.
        seed: of its machine, its motion and its noise.
    """
    for attempt in range(MACHINES):
        try:
            effects = _sized(question, seed, attempt)
        except (UserError, EstimationError):
            continue
        return Case(identifier, question.kind, effects, question.units, seed, attempt)
    raise UserError(f"No machine of {MACHINES} can be driven with {question}.", "Ask for another exam.")


def machine_of(seed: int, attempt: int) -> tuple[Machine, np.random.Generator]:
    """The machine of a case, without what it lacks, and what its other numbers are drawn from."""
    generator = np.random.default_rng([seed, attempt])
    machine = draw_machine(generator)
    travel = float(generator.uniform(*TRAVELS)) * reach_of(machine)
    return replace(machine, travel=travel), generator


def _sized(question: Question, seed: int, attempt: int) -> tuple[Injected, ...]:
    machine, generator = machine_of(seed, attempt)
    ruler = ruler_of(machine, seed)
    effects = []
    for name, sign in zip(question.names, question.signs, strict=True):
        missing = MISSING[name]
        values = missing.shape(machine, generator)
        if missing.as_met:
            size = missing.probe(machine) * math.exp(generator.uniform(0.0, math.log(missing.as_met)))
            if ruler.units(name, size, values) < question.units:
                raise UserError(f"{name} of {size:g} does not show.", "Draw another machine.")
        else:
            size = sign * ruler.size(name, question.units, values)
            if abs(size) > LARGEST * missing.probe(machine):
                raise UserError(f"{name} of {size:g} is none that one meets.", "Draw another machine.")
        effects.append(Injected(name, PLACE, MISSING[name].parameter, size, values))
    if not ruler.follows(machine_with(machine, tuple(effects))):
        raise UserError(f"A machine with {' and '.join(question.names)} runs away.", "Draw another machine.")
    return tuple(effects)
