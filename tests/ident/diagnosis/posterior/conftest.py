"""A search over the rows of a world whose truth is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from ident.diagnosis.posterior.asked import asked_of
from ident.diagnosis.posterior.hypotheses import Design
from ident.diagnosis.posterior.noise import Colours
from ident.diagnosis.posterior.products import Products
from ident.diagnosis.posterior.search import Search
from ident.diagnosis.problem import Problem
from ident.diagnosis.regression import Regression


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
