"""What is the same at one place and at all of its kind: the most symmetric stands first, the others are named.

One wheel's drag and a quarter of it at every wheel add the same to rows in which all wheels roll alike. Of those, what
all have is simpler to say, and nothing has to be special about one.
"""

from __future__ import annotations

from ident.diagnosis.probability import alike
from ident.diagnosis.search import without
from ident.diagnosis.shapes import Shaped, shaped
from ident.plant.places import GROUPS, members


def most_symmetric(found: Shaped) -> Shaped:
    """The same explanation at all equals where the records show no difference to one of them."""
    regression, taken = found.regression, found.taken
    candidates = found.problems[0].candidates
    for index, variant in enumerate(taken):
        own = candidates[regression.owners[variant]]
        slot = regression.slot(without(taken, index), regression.whitener(taken))
        wider = [
            other
            for other in alike(regression, slot, variant)
            if (candidate := candidates[regression.owners[other]]).effect == own.effect
            and candidate.where in GROUPS
            and own.where in members(candidate.where)
            and candidate.where != own.where
        ]
        if wider:
            best = max(wider, key=lambda other: float(slot.evidence.log_evidence[other]))
            taken = (*taken[:index], best, *taken[index + 1 :])
    return found if taken == found.taken else shaped(found.problems, regression, taken)
