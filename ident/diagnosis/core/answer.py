"""The answer: what follows from the best set of hypotheses, and from what may stand in the place of each member."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from ident.diagnosis.core.design import Design
from ident.diagnosis.core.evidence import Member
from ident.diagnosis.core.fit import Fit, fitted, temperature
from ident.diagnosis.core.functions import FILTER
from ident.diagnosis.core.hypotheses import LATE, Hypothesis, hypotheses
from ident.diagnosis.core.observations import OFFSET, observe
from ident.diagnosis.core.search import Search, State, price_of
from ident.diagnosis.delays import HELD
from ident.diagnosis.diagnosis import Diagnosis, NamedEffect, Verdict
from ident.diagnosis.findings import LAW
from ident.diagnosis.law.answer import Alternative, LawAnswer
from ident.diagnosis.law.dependence import Variable
from ident.records.axis_record import AxisRecord
from ident.vehicle.quantities import Quantity

CREDIBLE: Final = 0.95
"""Probability that the names of a set have together."""

DOUBTED: Final = 0.5
"""Probability of nothing in its place from which a member is none."""

EXACT: Final = 0.01
"""Share of the held-out gap that a member must close beside others, whose columns are exact to about as much."""

PLACE: Final = "axis"

NOTHING: Final = ""
"""Name of no hypothesis."""


@dataclass(frozen=True)
class Slot:
    """What may stand in one place of the best set.

    Attributes:
        odds: probability by name, NOTHING among them.
        first: the best hypothesis of the most probable name, with its numbers; None: a lag has none.
        variables: of the laws among them, the most probable first.
    """

    odds: Mapping[str, float]
    first: tuple[int, Member] | None
    variables: tuple[str, ...]

    @property
    def name(self) -> str:
        """The most probable one that is there."""
        return max((name for name in self.odds if name), key=lambda name: self.odds[name])

    @property
    def names(self) -> tuple[str, ...]:
        """Names that have CREDIBLE together of what there is, the most probable first."""
        order = sorted((name for name in self.odds if name), key=lambda name: -self.odds[name])
        share = np.cumsum([self.odds[name] for name in order]) / (1 - self.odds[NOTHING])
        return tuple(order[: int(np.searchsorted(share, CREDIBLE)) + 1])


@dataclass(frozen=True)
class Lag:
    """Of the motion behind its effort, beside the best set.

    Attributes:
        value, std: [s].
        widest: that sampling explains [s].
        odds: log odds of what may make more, against sampling.
    """

    value: float
    std: float
    widest: float
    odds: Mapping[str, float]

    @property
    def beyond(self) -> float:
        """What sampling does not explain of it [s]."""
        return math.copysign(max(abs(self.value) - self.widest, 0.0), self.value)

    @property
    def slot(self) -> Slot | None:
        """What makes it; None where sampling does."""
        whole = logsumexp([0.0, *self.odds.values()])
        odds = {name: math.exp(log - whole) for name, log in self.odds.items()}
        found = Slot({NOTHING: math.exp(-whole), **odds}, None, (Variable.LOAD_RATE,))
        return found if found.odds[NOTHING] < DOUBTED else None


def diagnose_by_core(
    fit: Sequence[AxisRecord], confirm: Sequence[AxisRecord], *, lacking: Collection[str] = ()
) -> Diagnosis:
    """What the model M a + Fv v + Fc sign(v) + offset of one axis lacks.

    Args:
        fit: records, of one axis.
        confirm: independent ones of the same axis.
        lacking: names of effects that are not looked for.

    Raises:
        RecordError: the records have several axes, or not the same.
        EstimationError: a record is too short, or the axis does not move.
    """
    observations, kind = observe(fit, confirm)
    tried = hypotheses(observations, lacking)
    search = Search(Design(observations, tried), price_of(len(tried) + len(LATE)))
    state = search.run()
    temper = temperature(state, len(fit))
    tempered = state.tempered(temper)
    slots = {index: _slot(tempered, index, search.price) for index in state.members}
    slots = {index: slot for index, slot in slots.items() if slot.odds[NOTHING] < DOUBTED}
    state, slots = _with_first(search, state, slots)
    lag = _lag(tempered, search.price, lacking)
    late = lag.slot
    beyond = 0.0 if late is None else lag.beyond
    led = late is not None and late.name in LATE and LATE[late.name].led
    found = fitted(state, len(fit), kind, led=led, lag=beyond, temper=temper)
    effects = [
        _named(tried[index], slot, found, index)
        for index, slot in slots.items()
        if not found.closed[index] < EXACT or len(slots) == 1
    ]
    effects += [] if late is None else [_late(late, lag, found)]
    effects.sort(key=lambda effect: -effect.probability)
    return Diagnosis(_verdict(effects), tuple(effects), (), found.gap, (), None)


def _with_first(search: Search, state: State, slots: Mapping[int, Slot]) -> tuple[State, dict[int, Slot]]:
    """The set of the most probable names, and its slots, where that is another than was found."""
    firsts = {index: slot.first for index, slot in slots.items() if slot.first is not None}
    members = {number: member for number, member in firsts.values()}
    if members.keys() == state.members.keys() or len(members) < len(slots):
        return state, dict(slots)
    return search.state(members, state), {first[0]: slots[index] for index, first in firsts.items()}


def _verdict(effects: Sequence[NamedEffect]) -> Verdict:
    if not effects:
        return Verdict.NONE
    return Verdict.LAW if any(effect.name == LAW for effect in effects) else Verdict.EFFECT


def _slot(state: State, index: int, price: float) -> Slot:
    """What may stand in the place of a member, by the evidence beside the others."""
    tried, tables = state.evidence.design.hypotheses, state.slot(index)
    logs = {number: table.total - price for number, table in tables.items()}
    whole = logsumexp([0.0, *logs.values()])
    odds = {NOTHING: math.exp(-whole)}
    for number, log in logs.items():
        odds[tried[number].name] = odds.get(tried[number].name, 0.0) + math.exp(log - whole)
    laws = {str(one.variable): logs[n] for n in logs if (one := tried[n].function) is not None}
    laws = dict(sorted(laws.items(), key=lambda each: each[1]))
    best = max(laws.values(), default=0.0)
    near = [variable for variable in reversed(laws) if laws[variable] - best > math.log(1 - CREDIBLE)]
    name = max((name for name in odds if name), key=lambda name: odds[name])
    first = max((number for number in logs if tried[number].name == name), key=lambda number: logs[number])
    return Slot(odds, (first, tables[first].best[0]), tuple(near))


def _lag(state: State, price: float, lacking: Collection[str]) -> Lag:
    """Lag beside a set; what makes it is sampling, a delay, a filter in the drive, or another filter of the load."""
    design = state.evidence.design
    one = design.observations[0]
    column = OFFSET + 1 + design.rates.index(one.sample_time)
    mean, covariance = state.evidence.plant_parameters(state.members)
    value, std = one.lag + float(mean[column]), math.sqrt(float(covariance[column, column]))
    widest, longest = HELD * one.sample_time, 2 * math.pi / one.filter.bandwidth
    above, below = float(norm.logsf(widest, value, std)), float(norm.logcdf(-widest, value, std))
    # Uniform within what sampling does, and within what such rows could show.
    sampled = math.log(max(-math.expm1(float(np.logaddexp(above, below))), np.finfo(float).tiny)) - math.log(2 * widest)
    late = float(np.logaddexp(above, below)) - math.log(2 * longest) - price - sampled
    odds = {
        name: late - cause.rarer + (state.led.log_evidence - state.log_evidence if cause.led else 0.0)
        for name, cause in LATE.items()
        if name not in lacking
    }
    free = next(index for index, each in enumerate(design.hypotheses) if each.function is FILTER)
    if free not in state.members:
        odds[LAW] = late + state.evidence.table(free, state.members).total
    return Lag(value, std, widest, odds)


def _named(hypothesis: Hypothesis, slot: Slot, found: Fit, index: int) -> NamedEffect:
    law, alternatives = None, list[Alternative]()
    if slot.name == LAW and hypothesis.free:
        law = found.laws[index]
        alternatives = [Alternative(None, one, PLACE) for one in slot.variables if one != law.variable]
    return NamedEffect(
        name=slot.name,
        where=PLACE,
        parameters=found.parameters.get(index, {}),
        probability=round(slot.odds[slot.name], 2),
        ambiguity_set=slot.names,
        gap_closed_held_out=found.closed[index],
        alternatives=tuple(alternatives),
        law=law,
    )


def _late(slot: Slot, lag: Lag, found: Fit) -> NamedEffect:
    law, parameters = None, {}
    if slot.name == LAW:
        law = LawAnswer(slot.variables[0], "", "", "dynamic", None, "", "", np.zeros((0, 3)), None, None, None)
    else:
        parameters = {LATE[slot.name].parameter: Quantity(lag.value, "s", "diagnosis", lag.std)}
    probability = round(slot.odds[slot.name], 2)
    return NamedEffect(slot.name, PLACE, parameters, probability, slot.names, found.gap.closed, (), law)
