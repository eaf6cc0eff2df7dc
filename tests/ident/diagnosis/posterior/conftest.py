"""A search over the rows of a world whose truth is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from ident.diagnosis.law.learning import Designs
from ident.diagnosis.posterior.bends import Bends
from ident.diagnosis.posterior.fitting import Fitter
from ident.diagnosis.posterior.hypotheses import Design, make_design
from ident.diagnosis.posterior.noise import Colours
from ident.diagnosis.posterior.products import Products
from ident.diagnosis.posterior.search import Search
from ident.diagnosis.problem import Problem
from ident.diagnosis.regression import Regression
from ident.diagnosis.rows import make_rows
from ident.diagnosis.settings import Settings


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
    regression = Regression(fit, make_rows(fit, confirm), Settings(), 1)
    colours = Colours(regression)
    design = make_design((fit, confirm), regression, colours, Designs((fit, confirm), regression.rows))
    search = Search(Fitter(design, colours, Bends((fit, confirm), colours)))
    return Question(regression, colours, design, Products(design, colours, np.arange(design.columns.shape[1])), search)


@pytest.fixture
def asked() -> Callable[[Problem, Problem], Question]:
    return _asked
