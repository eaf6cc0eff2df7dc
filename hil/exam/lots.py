"""What an exam is drawn from: a secret, so that nobody can draw it again, or seeds, for sets to tune on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from hil.exam.cases import SEEDS_PER_CASE
from hil.exam.key import Key


@dataclass(frozen=True)
class Lots:
    """Everything random in an exam.

    Attributes:
        questions: draws effects, places, sizes, signs and their order.
        identifiers: draws the names of the cases, which everybody sees.
        noise: seed by number of a case; this one while fitting, the next while confirming.
        excitation: seed by number of a pair of campaigns.
    """

    questions: np.random.Generator
    identifiers: np.random.Generator
    noise: Callable[[int], int]
    excitation: Callable[[int], int]


def lots_of_seed(first: int) -> Lots:
    """Lots that follow from the first seed."""
    generator = np.random.default_rng(first)
    return Lots(generator, generator, lambda case: first + SEEDS_PER_CASE * case, lambda number: first + number)


def lots_of_key(key: Key, salt: bytes) -> Lots:
    """Lots that follow from a secret.

    Each has a stream of its own: from what shows (names, noise, excitations) nothing follows about the rest.
    """
    seed = partial(key.number, salt)
    return Lots(
        np.random.default_rng(seed("questions")),
        np.random.default_rng(seed("identifiers")),
        lambda case: seed(f"noise {case}"),
        lambda number: seed(f"excitation {number}"),
    )
