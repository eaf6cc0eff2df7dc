"""What is computed once the search has ended: how much is closed, what is left, and which verdict that makes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.findings import Cause, Findings, ordered
from ident.diagnosis.fitted import Fitted
from ident.diagnosis.law.answer import LawAnswer, alternatives, law_answer, same_names
from ident.diagnosis.law.drift import drift_cause
from ident.diagnosis.law.free import Curve, curves
from ident.diagnosis.law.neighbours import channel_of, nearest_name
from ident.diagnosis.law.reach import told_samples
from ident.diagnosis.law.stage import Law
from ident.diagnosis.limits import Limits
from ident.diagnosis.probability import calibration, rank
from ident.diagnosis.problem import Problem
from ident.diagnosis.regression import Regression
from ident.diagnosis.remainder import Told, repeated, shares
from ident.diagnosis.repeating import Repeating
from ident.diagnosis.search import Found
from ident.diagnosis.sized import is_nothing, is_sizeless
from ident.diagnosis.steady import log_unsteady

Array = NDArray[np.float64]


class Judgement:
    """What is computed once the search has ended."""

    def __init__(
        self,
        problems: Sequence[Problem],
        regression: Regression,
        found: Found,
        limits: Limits,
        seed: int,
        laws: Sequence[Law] = (),
    ) -> None:
        self.problems, self.regression, self.found, self.limits = problems, regression, found, limits
        self.laws = laws
        self.rows = regression.rows
        self.fitted = Fitted(problems, regression, found, seed, told_samples(self.rows, problems, self._law_keys()))

    def findings(self, drift: Law | None = None) -> Findings:
        """The answer, with all that reports show of it; beside a drift that was taken off before."""
        drifting = () if drift is None else (drift_cause(drift, self.fitted.closed_by_drift, calibration()),)
        causes, verdict = (*self._causes(), *drifting), self._verdict()
        if any(cause.law is not None for cause in causes) and (verdict is not Verdict.UNKNOWN):
            verdict = Verdict.LAW
        return Findings(
            verdict=verdict,
            causes=causes,
            doubtful=self._doubtful(),
            events=tuple(self.problems[0].candidates[owner].key for owner in self.found.rest.events),
            gap=self.fitted.settled if verdict is Verdict.NONE else self.fitted.exactly,
            where=shares(self.rows, self.fitted.floors, self.fitted.judged()),
            invisible=self.regression.invisible(),
            before=self.fitted.before,
            after=self.fitted.after,
            significance=min(slot.evidence.significance for slot in (self.found.rest, *self.found.slots)),
            remainder=self.fitted.rest,
            lasting=self._repeats.most > 1,
            repeated_before=self._sizes(self.fitted.judged()),
            repeated_after=self._sizes(self.fitted.after.blocks),
            problem=self.problems[0],
            held_out=self.fitted.held_out(),
        )

    def incomplete(self) -> bool:
        """Whether something is left beside the effects that a law may explain, or one of them has another curve."""
        left = self._verdict() is Verdict.UNKNOWN or self._predictable() or self._repeats.by_no_accident
        bent = Curve.ANOTHER in self._curves
        return left or bent or self.fitted.exactly.after**2 > 1 + self.limits.measurable

    @property
    def has_law(self) -> bool:
        """Whether a law is one of the causes."""
        return bool(self._law_keys())

    def _law_keys(self) -> list[str]:
        owners = {self.regression.owners[variant] for variant in self.found.variants}
        return [law.dependence.key for law in self.laws if law.number in owners]

    def cost(self, floors: Array, labels: Collection[str], told: Told) -> tuple[float, int]:
        """Of an explanation: log of the held-out gap that it leaves, and what its causes cost, and their number.

        A law, which can be anything, costs more than a name, which says more; what nobody knows costs as much as a law.
        The gap is what lies above the noise, beside what no record tells from noise: what is closed of a small gap
        counts as much as of a large one.

        Args:
            floors: noise of every block, the same for all explanations that are compared.
            labels: of the blocks in which some of them act: the others say nothing for or against any.
            told: samples of every block in which the laws of all of them are told.
        """
        laws = sum(self._law(index) is not None for index in range(self.fitted.count))
        unknown = self._verdict() is Verdict.UNKNOWN
        price = self.limits.law * (laws + unknown) + self.limits.name * (self.fitted.count - laws)
        above = max(self.fitted.measured(floors, labels, told).after ** 2 - 1, 0.0)
        return round(50 * (math.log(above + self.limits.blur) / 2 + price)) / 50, self.fitted.count

    def refuted(self) -> frozenset[str]:
        """Effects of no size of which another candidate is what comes along with them, and those that are none."""
        keys = {candidate.key for candidate in self.problems[0].candidates if not candidate.excluded}
        sizeless = [self.fitted.candidate(index) for index in range(self.fitted.count) if self._sizeless(index)]
        none = [self.fitted.candidate(index) for index in range(self.fitted.count) if self._nothing(index)]
        along = [one for one in sizeless if f"{one.along}@{one.where}" in keys]
        return frozenset(one.key for one in (*along, *none))

    def worthwhile(self) -> tuple[int, ...]:
        """The effects without one that widens the held-out gap, is of no size itself, or closes next to nothing.

        A gap within the accidents of the noise can seem to be widened by what the rows are for.
        """
        closed = self.fitted.closed
        widened = [index for index, share in enumerate(closed) if share < -self.limits.widening]
        refuted = widened if self._measurable() else []
        laws = [index for index in range(self.fitted.count) if self._law(index)]
        bent = [index for index in laws if self.fitted.closed_where_it_acts(index) <= self._least(index)]
        for superfluous in (refuted, bent):
            if superfluous:
                return self.fitted.others(min(superfluous, key=lambda index: closed[index]))
        others = [index for index in range(self.fitted.count) if index != self._strongest] if closed else []
        for index in others:
            if self._sizeless(index) or self._nothing(index):
                return self.fitted.others(index)
        pays = {index: self._pays(index) for index in others} if self._measurable() else {}
        if not all(pays.values()):
            return self.fitted.others(min((one for one in pays if not pays[one]), key=lambda one: closed[one]))
        return self.found.variants

    def _least(self, index: int) -> float:
        """Share of the held-out gap that a law must close where it acts."""
        if self._measurable():
            return self.limits.law
        # Of a gap within the accidents of the noise evidence says more, but for what has that noise in it.
        law = self._law(index)
        alone = self.fitted.count == 1 and law is not None and not law.dependence.is_noisy
        return -math.inf if alone else 0.0

    def _pays(self, index: int) -> bool:
        """Whether an effect beside others closes a part of the gap that counts, or gains what a name costs."""
        if self.fitted.lacking[index] >= self.limits.improvement:
            return True
        return self.fitted.gain(index, self.limits.blur) >= self.limits.name

    @cached_property
    def _curves(self) -> tuple[Curve, ...]:
        """Of every effect, whether its name fits the curve of its variable as well as a free function does."""
        return curves(self.problems, self.regression, self.found)

    def _law(self, index: int) -> Law | None:
        """The law that a cause is, if it is one."""
        owner = self.regression.owners[self.found.variants[index]]
        return next((law for law in self.laws if law.number == owner), None)

    def _log_evidence(self, index: int) -> float:
        return float(self.found.slots[index].evidence.log_evidence[self.found.variants[index]])

    def _log_predictive(self, index: int) -> float:
        return float(self.found.slots[index].evidence.log_predictive[self.found.variants[index]])

    def _measurable(self) -> bool:
        """Whether the held-out gap that effects could close is more than an accident of the noise."""
        return self.fitted.removable > self.limits.measurable * self.fitted.whole.floor**2

    def _doubtful(self) -> Mapping[str, float]:
        rest = self.found.rest
        return rank(self.regression, rest, rest.variants[0], calibration()).probabilities if rest.variants else {}

    @property
    def _strongest(self) -> int:
        """The effect that closes most."""
        return int(np.argmax(self.fitted.closed))

    def _explained(self) -> float:
        """Share of what can be predicted of the confirming rows that the effects taken explain."""
        named = max(self.fitted.bare.before - self.fitted.rest.before, 0.0)
        return named / max(named + self.fitted.rest.gain, np.finfo(float).tiny)

    def _verdict(self) -> Verdict:
        if not self.found.variants:
            left = self._predictable() or self._repeats.surely or self._far_off()
            return Verdict.UNKNOWN if left else Verdict.NONE
        unexplained = self._predictable() and self._explained() < self.limits.explained
        strange = unexplained or self._lasting() or self._foreign() or self._unsteady() or self._tangled()
        another = self._sizeless(self._strongest) or self._nothing(self._strongest)
        return Verdict.UNKNOWN if strange or another or self._short() else Verdict.EFFECT

    def _far_off(self) -> bool:
        """Whether the held-out gap is too large to be called noise, whatever can be predicted of it."""
        count = max(int(self.rows.confirming.sum()), 1)
        return self.fitted.settled.after > 1 + max(self.limits.far_off, self.limits.scarce / math.sqrt(count))

    def _short(self) -> bool:
        """Whether the model with all effects, refitted exactly, is further from the held-out rows than without any.

        Or hardly nearer, where nothing repeats and what is left is too large to be called noise.
        """
        closed, hardly = self.fitted.exactly.closed, not self._repeats.sizes and self._far_off()
        return self._measurable() and closed < (self.limits.most if hardly else -self.limits.widening)

    def _foreign(self) -> bool:
        """Whether something lasts in rows that the model itself says nothing of: what shows there is all of a cause.

        Not where no effect acts in them and one closes nearly all elsewhere: on a slope, a unit that is steered at rest
        moves in its coupling too.
        """
        foreign = {block.label for block, _ in self.rows.blocks if not block.baseline.any()}
        lasts = {
            label for label, size in self._repeats.sizes.items() if label in foreign and size > self.limits.foreign
        }
        return bool(lasts & self.fitted.reached) or (bool(lasts) and self._named < self.limits.nearly)

    def _unsteady(self) -> bool:
        """Whether the effects would rather have other sizes in some steps, where their columns are all there is."""
        columns = [self.rows.layout[variant] for variant in self.found.variants]
        candidates = [self.problems[0].candidates[column.candidate] for column in columns]
        exact = all(one.contribution is None for one in candidates)
        evidence = max(self._log_evidence(index) for index in range(self.fitted.count))
        limit = max(self.limits.unsteady, self.limits.bent * evidence)
        return exact and log_unsteady(self.regression, self.found) > limit

    def _tangled(self) -> bool:
        """Whether many names share the friction of one kind of joint: so many changes of a curve are another curve."""
        owners = {self.regression.owners[variant] for variant in self.found.variants}
        curves = Counter(self.problems[0].candidates[owner].curve for owner in owners)
        return any(count >= self.limits.curve for curve, count in curves.items() if curve)

    def _sizeless(self, index: int) -> bool:
        return is_sizeless(self.fitted.candidate(index), self.fitted.after.parts[index], self.limits)

    def _nothing(self, index: int) -> bool:
        return is_nothing(self.fitted.candidate(index), self.fitted.after.parts[index], self.limits)

    @cached_property
    def _named(self) -> float:
        """What the effect that closes most closes, alone or beside the others, in that and what all of them leave."""
        most = max(*self.fitted.closed, *(self.fitted.gap((variant,)).closed for variant in self.found.variants))
        return max(most, 0.0) / max(most + self.fitted.left, np.finfo(float).tiny)

    def _surest(self) -> float:
        """Where something repeats that all effects leave, the name of the strongest may be part of another cause."""
        return self._named if self.limits.humble and self._repeats.most > 1 else 1.0

    def _predictable(self) -> bool:
        """Whether a smooth function of the states predicts what the effects leave, and it is no trifle."""
        sizes = self._sizes(self.fitted.after.blocks)
        large = not sizes or max(sizes.values()) > self.limits.size
        return large and self.fitted.rest.deviations > self.limits.deviations and self.fitted.rest.gain > 0

    def _lasting(self) -> bool:
        """Whether more repeats than may, and the effects close too little of that, and of all, to have it pardoned."""
        if self._named >= self.limits.nearly:
            return False
        before = replace(self._repeats, models=self.fitted.judged()).sizes
        pardoned = {label: (1 - self.limits.nearly) * size**2 for label, size in before.items()}
        return any(size**2 > pardoned[label] for label, size in self._repeats.above.items())

    @cached_property
    def _repeats(self) -> Repeating:
        stricter = bool(self.found.variants) and self._measurable()
        return Repeating(self.rows, self.fitted.floors, self.fitted.after.blocks, self.limits, stricter=stricter)

    def _sizes(self, models: Sequence[Array]) -> Mapping[str, float]:
        return repeated(self.rows, self.fitted.floors, models)

    def _causes(self) -> tuple[Cause, ...]:
        made = [self._cause(index, variant) for index, variant in enumerate(self.found.variants)]
        return ordered(made)

    def _cause(self, index: int, variant: int) -> Cause:
        settings = calibration()
        ranked = rank(self.regression, self.found.slots[index], variant, settings)
        law = self._law(index)
        probability = ranked.probability if law is None else law.probability(settings.temperature)
        return Cause(
            candidate=self.fitted.candidate(index),
            part=self.fitted.after.parts[index],
            ranked=ranked,
            probability=min(probability, settings.ceiling, self._surest()),
            log_evidence=self._log_evidence(index),
            log_predictive=self._log_predictive(index),
            # Nothing is said to widen a gap within the accidents of its noise.
            closed=max(self.fitted.lacking[index], -math.inf if self._measurable() else 0.0),
            needed=self.fitted.closed[index],
            biased=self.fitted.biased(index),
            sizeless=self._sizeless(index),
            curve=self._curves[index],
            law=law,
            law_answer=None if law is None else self._law_answer(law, index, variant),
            alternatives=(same_names(ranked.alike) if law is None else alternatives(law, self.problems[0].dependences)),
        )

    def _law_answer(self, law: Law, index: int, variant: int) -> LawAnswer:
        nearest = nearest_name(self.regression, self.found.slots[index], variant, {law.number for law in self.laws})
        return law_answer(law, channel_of(self.problems[0], self.rows.layout[variant]), nearest)
