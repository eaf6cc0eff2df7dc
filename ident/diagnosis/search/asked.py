"""What the posterior is asked, and asked again with what a set that was found hid."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ident.diagnosis.evidence.fitting import Fitter
from ident.diagnosis.evidence.state import State
from ident.diagnosis.hypotheses.bends import Bends
from ident.diagnosis.hypotheses.hypotheses import Design, make_design
from ident.diagnosis.law.learning import Designs
from ident.diagnosis.noise.colours import Colours
from ident.diagnosis.observations.regression import Regression
from ident.diagnosis.observations.rows import make_rows
from ident.diagnosis.observations.whitening import Left
from ident.diagnosis.problem import Problem
from ident.diagnosis.search.differing import with_known_differences
from ident.diagnosis.search.hidden import with_hidden_orders
from ident.diagnosis.search.swallowed import beside_a_law


@dataclass(frozen=True)
class Asked:
    """What the posterior is asked.

    Attributes:
        problems: to fit and to confirm.
        regression: their rows.
        designs: of their laws.
        design: of all hypotheses.
        fitter: of sets of them.
    """

    problems: tuple[Problem, ...]
    regression: Regression
    designs: Designs
    design: Design
    fitter: Fitter


def asked_beside(asked: Asked, state: State) -> Asked | None:
    """The same asked with what was hidden by a set: noise that is less without it, orders of ripples."""
    if not state.members:
        return None
    problems, left = asked.problems, None
    if Colours.repeats(asked.regression):
        problems = with_known_differences(problems, asked.regression, asked.design, asked.designs, state)
    else:
        left = asked.fitter.left(state)
    problems = with_hidden_orders(problems, asked.design, asked.designs, state) or problems
    return None if problems is asked.problems and left is None else asked_of(problems, asked.designs, left)


def asked_once_more(asked: Asked, again: Asked, state: State) -> Asked | None:
    """The second question, what its set differs by known better; None where the first one knew nothing of that.

    Numbers that were found with a drift in the noise are rough, and leave some of it there.

    Args:
        asked, again: the first question, and the one beside what was found.
        state: what was found by that.
    """
    if all(one.blocks is other.blocks for one, other in zip(asked.problems, again.problems, strict=True)):
        return None
    known = with_known_differences(asked.problems, asked.regression, again.design, again.designs, state)
    if known is asked.problems:
        return None
    problems = tuple(replace(mine, blocks=one.blocks) for mine, one in zip(again.problems, known, strict=True))
    return asked_of(problems, again.designs)


def asked_beside_a_law(asked: Asked, state: State) -> Asked | None:
    """The same asked with the noise beside a law that it may have swallowed; None where repeats tell the noise."""
    if Colours.repeats(asked.regression):
        return None
    left = beside_a_law(asked.problems[0], asked.regression.rows, asked.designs, asked.fitter.left(state))
    return None if left is None else asked_of(asked.problems, asked.designs, left)


def asked_of(problems: tuple[Problem, ...], designs: Designs | None = None, left: Left | None = None) -> Asked:
    """Everything that may be there, and what fits it.

    Args:
        problems: to fit and to confirm.
        designs: of their laws, made for other candidates; None: they are made.
        left: what a set leaves of their rows.
    """
    regression = Regression(problems[0], make_rows(*problems))
    colours, designs = Colours(regression, left), designs or Designs(problems, regression.rows)
    design = make_design(problems, regression, colours, designs)
    return Asked(problems, regression, designs, design, Fitter(design, colours, Bends(problems, colours)))
