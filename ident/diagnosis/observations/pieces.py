"""Problems that are several: rows of which no parameter and no cause stands in those of others.

Every axis of a robot has its own equation, whatever motions of others stand in it. Asked together they are one set of
hypotheses, six times as many, of which four may be taken; asked one after the other they are six problems.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from ident.diagnosis.dependence import Basis, Dependence
from ident.diagnosis.problem import Candidate, Contribution, Problem, Series, Turned

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Piece:
    """A part of problems to fit and to confirm that nothing else stands in.

    Attributes:
        problems: those parts.
        blocks: numbers of their blocks, in each of the problems.
        parameters: numbers (p,) of their parameters.
        dependences: numbers of theirs.
    """

    problems: tuple[Problem, ...]
    blocks: tuple[tuple[int, ...], ...]
    parameters: Indices
    dependences: tuple[int, ...]


def pieces_of(problems: Sequence[Problem]) -> list[Piece]:
    """The parts of problems that have nothing in common, at least one; what acts nowhere belongs to the first."""
    first, ends = problems[0], np.cumsum([0, *(len(problem.blocks) for problem in problems)])
    shared = [*_parameters(problems), *_candidates(problems), *_dependences(problems)]
    edges = [(block, int(ends[-1]) + number) for number, acting in enumerate(shared) for block in acting]
    size = int(ends[-1]) + len(shared)
    graph = sparse.coo_matrix((np.ones(len(edges)), tuple(zip(*edges, strict=True))), shape=(size, size))
    labels = csgraph.connected_components(graph, directed=False)[1]
    numbers = list(dict.fromkeys(labels[: ends[-1]].tolist()))
    labels = np.where(np.isin(labels, numbers), labels, numbers[0])
    blocks = [labels[start:stop] for start, stop in pairwise(ends)]
    widths = np.cumsum([len(first.names), len(first.candidates), len(first.dependences)])
    parameters, candidates, dependences = np.split(labels[ends[-1] :], widths[:-1])
    return [
        _piece(
            problems,
            [np.flatnonzero(each == one) for each in blocks],
            np.flatnonzero(parameters == one),
            np.flatnonzero(candidates == one),
            np.flatnonzero(dependences == one),
        )
        for one in numbers
    ]


def _parameters(problems: Sequence[Problem]) -> Iterator[list[int]]:
    """Blocks in which each parameter stands."""
    blocks = [block for problem in problems for block in problem.blocks]
    acting = np.array([np.any(block.baseline != 0, axis=0) for block in blocks])
    for column in acting.T:
        yield np.flatnonzero(column).tolist()


def _candidates(problems: Sequence[Problem]) -> Iterator[list[int]]:
    """Blocks in which each candidate acts."""
    for each in zip(*(problem.candidates for problem in problems), strict=True):
        acting = [
            any(column is not None for column in columns)
            for candidate in each
            for columns in zip(*(variant.columns for variant in candidate.variants), strict=True)
        ]
        yield np.flatnonzero(acting).tolist()


def _dependences(problems: Sequence[Problem]) -> Iterator[list[int]]:
    """Blocks in which each law acts."""
    for each in zip(*(problem.dependences for problem in problems), strict=True):
        yield np.flatnonzero([one is not None for dependence in each for one in dependence.arguments]).tolist()


def _piece(
    problems: Sequence[Problem], blocks: Sequence[Indices], parameters: Indices, candidates: Indices, laws: Indices
) -> Piece:
    kept = [each.tolist() for each in blocks]
    return Piece(
        tuple(_part(*pair, parameters, candidates, laws) for pair in zip(problems, kept, strict=True)),
        tuple(tuple(each) for each in kept),
        parameters,
        tuple(laws.tolist()),
    )


def _part(problem: Problem, kept: list[int], parameters: Indices, candidates: Indices, laws: Indices) -> Problem:
    names = tuple(problem.names[number] for number in parameters)
    nominal = problem.nominal
    return Problem(
        names=names,
        units=tuple(problem.units[number] for number in parameters),
        blocks=tuple(
            replace(problem.blocks[number], baseline=problem.blocks[number].baseline[:, parameters]) for number in kept
        ),
        candidates=tuple(
            _candidate(problem.candidates[number], kept, parameters, len(problem.names)) for number in candidates
        ),
        nominal=None if nominal is None else nominal.of(parameters),
        spreads={name: spread for name, spread in problem.spreads.items() if name in names},
        dependences=tuple(_dependence(problem.dependences[number], kept) for number in laws),
    )


def _candidate(candidate: Candidate, kept: list[int], parameters: Indices, count: int) -> Candidate:
    """In some blocks; its forms are asked with all parameters, and say something of all blocks."""

    def only(form: Contribution | None) -> Contribution | None:
        if form is None:
            return None

        def part(values: Array, baseline: Array) -> Series:
            whole = np.zeros(count)
            whole[parameters] = baseline
            return _chosen(form(values, whole), kept)

        return part

    variants = tuple(replace(one, columns=tuple(_chosen(one.columns, kept))) for one in candidate.variants)
    return replace(
        candidate,
        variants=variants,
        contribution=only(candidate.contribution),
        force=only(candidate.force),
        turned=_turned(candidate, kept),
    )


def _turned(candidate: Candidate, kept: list[int]) -> Turned | None:
    form, count = candidate.turned, len(candidate.variants[0].columns)
    if form is None:
        return None

    def part(values: Array, forces: Series) -> Series:
        whole: list[Array | None] = [None] * count
        for number, force in zip(kept, forces, strict=True):
            whole[number] = force
        return _chosen(form(values, whole), kept)

    return part


def _dependence(dependence: Dependence, kept: list[int]) -> Dependence:
    def design(basis: Basis, *, apart: bool = False) -> Series:
        return _chosen(dependence.design(basis, apart=apart), kept)

    return replace(dependence, arguments=tuple(_chosen(dependence.arguments, kept)), design=design)


def _chosen(series: Series, kept: Sequence[int]) -> list[Array | None]:
    return [series[number] for number in kept]
