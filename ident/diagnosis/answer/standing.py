"""The best set of hypotheses, what may stand in the place of each member, and their exact refits."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Final

from ident.diagnosis.answer.taken import as_variants
from ident.diagnosis.check.fitted import Fitted, Taken
from ident.diagnosis.evidence.state import State
from ident.diagnosis.evidence.tables import Member
from ident.diagnosis.law.reach import told_samples
from ident.diagnosis.noise.colours import SIZES, Colours
from ident.diagnosis.search.asked import Asked
from ident.diagnosis.search.search import Search
from ident.diagnosis.search.slots import UNLISTED, slot_of

MEASURABLE: Final = 0.05
"""Power of what causes could close of a held-out gap, over the noise's, from which that is no accident of the noise."""

MISTAKEN: Final = 1.0
"""What is lacking, over noise and tolerance, that may be a mistake in those."""

INEXACT: Final = 0.1
"""Share of the held-out gap by which members may miss it together, or seem to widen it; of all that is held out, where
the gap is within the accidents of its noise."""

OPEN: Final = 0.5
"""Share of the held-out gap that members leave, more being lacking than is tolerated, from which they are no answer."""


class Standing:
    """What is computed of the best set.

    Args:
        asked: what was asked.
        search: that found the set.
        state: the set.
        seed: of the smooth function of what is left.

    Attributes:
        slots: places of the members, by number.
        taken: the members as variants of the problems' candidates.
    """

    def __init__(self, asked: Asked, search: Search, state: State, seed: int) -> None:
        self.search, self.state, self.design, self._seed = search, state, asked.design, seed
        excess, whole = search.fitter.excess(state), search.fitter.among_all(state)
        self.slots = {index: slot_of(search, whole, index, excess[index]) for index in state.members}
        self.taken = as_variants(asked.problems, asked.regression, asked.designs, self.design, state, self.slots)

    @cached_property
    def fitted(self) -> Fitted:
        """The exact refits of the members."""
        regression = self.taken.regression
        keys = [law.dependence.key for law in self.taken.laws.values()]
        found = Taken(tuple(self.taken.variants.values()), self.state.evidence.noise)
        told = told_samples(regression.rows, self.taken.problems, keys)
        return Fitted(self.taken.problems, regression, found, self._seed, told)

    @property
    def is_measurable(self) -> bool:
        """Whether the held-out gap that causes could close is more than an accident of the noise."""
        return self.fitted.removable > MEASURABLE * self.fitted.whole.floor**2

    @cached_property
    def odds_beside(self) -> dict[int, float]:
        """Log odds of everything that can be there beside the set: of what is likelier than nothing as of a member.

        That is fitted, and its evidence tempered, which makes it no likelier.
        """
        tables, hypotheses = self.search.fitter.among_all(self.state).tables(), self.design.hypotheses
        raw = {index: table.total - hypotheses[index].price for index, table in tables.items() if table.is_there}
        return {index: self._fitted_odds(index, tables[index].best) if log > 0 else log for index, log in raw.items()}

    def _fitted_odds(self, index: int, member: Member) -> float:
        fitter = self.search.fitter
        found = fitter.state({**self.state.members, index: member}, self.state)
        return fitter.odds(found, index, self.state) if math.isfinite(found.log_posterior) else -math.inf

    @cached_property
    def is_lacking(self) -> bool:
        """Whether more is lacking somewhere than noise and tolerance that are not known exactly.

        Of rows without repeats the noise is what the fitted ones leave: the confirming ones may say more.
        """
        if any(SIZES[size] > MISTAKEN for size in self.state.evidence.sizes):
            return True
        return not Colours.repeats(self.taken.regression) and self._leaves_more

    @property
    def unlisted(self) -> float:
        """Probability that what stands in a place is none of the hypotheses as they are written.

        Where the members leave more held out than noise that is not known exactly, and more than forms of what is large
        are exact to, there is something that the library does not have: beside them, or in the place of one, of which
        neither is likelier.
        """
        is_open = self._leaves_more and self.fitted.exactly.closed < 1 - INEXACT
        return 1 / (1 + self.fitted.count) if is_open else UNLISTED

    @property
    def _leaves_more(self) -> bool:
        gap = self.fitted.beside_what_is_known
        return gap.after > math.hypot(1.0, MISTAKEN) * gap.floor
