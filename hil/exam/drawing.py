"""Draws the cases of an exam at random: balanced over names, places and sizes, in shuffled order."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from hil.exam.cases import SIZES, Case, Injected, Kind
from hil.exam.corruptions import draw_corruption
from hil.exam.drawn_laws import draw_laws
from hil.exam.sizes import EffectSize, SizeTable
from hil.exam.sources import Source
from ident.errors import UserError

UNKNOWN_SIZES: Final = (0.5, 1.0, 2.0)
"""Of the effects that have no candidate, in noise units."""

LAW_SIZES: Final = (1.0, 2.0)
"""Range of the sizes of laws without a name, in noise units, after what the parameters of the model absorb."""


@dataclass(frozen=True)
class Composition:
    """How many cases of each kind, and how many pairs of campaigns they share.

    One excitation shows some effects better than another and leaves the wheels askew in its own way: rates of cases
    that all drive the same one are those of that excitation.
    """

    effects: int = 240
    pairs: int = 24
    none: int = 60
    unknown: int = 40
    invisible: int = 24
    laws: int = 32
    faults: int = 16
    excitations: int = 24

    @property
    def total(self) -> int:
        """Of all kinds."""
        return sum(self.asked.values())

    @property
    def asked(self) -> Mapping[Kind, int]:
        """By kind."""
        return {
            Kind.EFFECT: self.effects,
            Kind.PAIR: self.pairs,
            Kind.NONE: self.none,
            Kind.UNKNOWN: self.unknown,
            Kind.INVISIBLE: self.invisible,
            Kind.LAW: self.laws,
            Kind.FAULT: self.faults,
        }

    @property
    def driven(self) -> int:
        """Excitations that some case drives."""
        return min(self.excitations, self.total)


ABSENT: Final[Mapping[Source, tuple[str, ...]]] = {
    Source.EMULATOR: (),
    Source.FIRST_PRINCIPLES: ("unknown",),
    Source.AXES: ("unknown", "invisible", "faults"),
}
"""Kinds of cases that a source does not have."""


def composition_of(source: Source, given: Mapping[str, int | None]) -> Composition:
    """What is asked for, and what a source has by default of all that is not.

    Args:
        source: what drives the cases.
        given: number by kind, as the fields of `Composition`; None where nothing was asked for.
    """
    absent = dict.fromkeys(ABSENT[source], 0)
    return replace(Composition(**absent), **{kind: count for kind, count in given.items() if count is not None})


def draw_cases(
    table: SizeTable,
    composition: Composition,
    noise: Callable[[int], int],
    generator: np.random.Generator,
    names: np.random.Generator | None = None,
) -> list[Case]:
    """Cases in shuffled order.

    Args:
        table: what size each effect has in noise units.
        composition: how many of which kind.
        noise: seed by number of a case; with the next one it is that case's alone.
        generator: of everything that is drawn.
        names: of the identifiers, which everybody sees; None: the same.

    Raises:
        UserError: the table has no effect of a kind that is asked for.
    """
    questions = [
        *_singles(table.visible, composition.effects, SIZES, Kind.EFFECT, generator),
        *_pairs(table.visible, composition.pairs, generator),
        *((Kind.NONE, (), 0.0) for _ in range(composition.none)),
        *_singles(table.unknown, composition.unknown, UNKNOWN_SIZES, Kind.UNKNOWN, generator),
        *_hidden(table.invisible, composition.invisible, generator),
        *_laws(table, composition.laws, generator),
        *_faults(composition.faults, generator),
    ]
    order = generator.permutation(len(questions))
    identifiers = identifiers_of(len(questions), names or generator)
    cases = []
    for number, (position, identifier) in enumerate(zip(order.tolist(), identifiers, strict=True)):
        kind, effects, noise_units = questions[position]
        cases.append(Case(identifier, kind, effects, noise_units, noise(number), number % composition.driven))
    return cases


_Question = tuple[Kind, tuple[Injected, ...], float]


def identifiers_of(count: int, generator: np.random.Generator) -> list[str]:
    """Names of cases, which tell nothing."""
    found: dict[str, None] = {}
    while len(found) < count:
        found[generator.bytes(6).hex()] = None
    return list(found)


def _by_name(rows: Sequence[EffectSize], generator: np.random.Generator) -> list[Iterator[EffectSize]]:
    """For each name, its places over and over, in random order."""
    names = list(dict.fromkeys(row.name for row in rows))
    if not names:
        raise UserError("The size table has no effect of a kind that the exam asks for.", "Ask for none of them.")
    rounds: list[Iterator[EffectSize]] = []
    for name in names:
        places = [row for row in rows if row.name == name]
        rounds.append(itertools.cycle([places[index] for index in generator.permutation(len(places))]))
    return rounds


def _singles(
    rows: Sequence[EffectSize], count: int, sizes: Sequence[float], kind: Kind, generator: np.random.Generator
) -> Iterator[_Question]:
    """Names in turn; each name runs through the sizes, and through its places."""
    if not count:
        return
    rounds = _by_name(rows, generator)
    for number in range(count):
        turn, name = divmod(number, len(rounds))
        size = sizes[(turn + name) % len(sizes)]
        yield kind, (_injected(next(rounds[name]), size, generator),), size


def _pairs(rows: Sequence[EffectSize], count: int, generator: np.random.Generator) -> Iterator[_Question]:
    """Two effects of different names, both as large as the largest size."""
    if not count:
        return
    rounds = _by_name(rows, generator)
    for _ in range(count):
        first, second = generator.choice(len(rounds), size=2, replace=False)
        chosen = (_injected(next(rounds[index]), SIZES[-1], generator) for index in (first, second))
        yield Kind.PAIR, tuple(chosen), SIZES[-1]


def _hidden(rows: Sequence[EffectSize], count: int, generator: np.random.Generator) -> Iterator[_Question]:
    """Effects that these campaigns do not show, as large as they are in practice."""
    if not count:
        return
    rounds = _by_name(rows, generator)
    for number in range(count):
        row = next(rounds[number % len(rounds)])
        sign = generator.choice([-1.0, 1.0]) if row.signed else 1.0
        yield Kind.INVISIBLE, (Injected(row.name, row.where, row.parameter, sign * row.largest),), 0.0


def _laws(table: SizeTable, count: int, generator: np.random.Generator) -> Iterator[_Question]:
    """Laws without a name."""
    sizes = generator.uniform(*LAW_SIZES, size=count).tolist()
    for law, size in zip(draw_laws(table, sizes, generator), sizes, strict=True):
        yield Kind.LAW, (law,), size


def _faults(count: int, generator: np.random.Generator) -> Iterator[_Question]:
    """Faults of both records of a vehicle that has no effect."""
    for _ in range(count):
        name, channel, step, value = draw_corruption(generator)
        yield Kind.FAULT, (Injected(name, channel, step, value),), 0.0


def _injected(row: EffectSize, noise_units: float, generator: np.random.Generator) -> Injected:
    sign = generator.choice([-1.0, 1.0]) if row.signed else 1.0
    return Injected(row.name, row.where, row.parameter, float(sign * row.physical(noise_units)))
