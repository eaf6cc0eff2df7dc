"""The answer: what follows from the best set of hypotheses, and from what may stand in the place of each member."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import norm

from ident.diagnosis.core.evidence import Design, Table
from ident.diagnosis.core.fit import Fit, fitted, temperature
from ident.diagnosis.core.functions import FILTER
from ident.diagnosis.core.hypotheses import Hypothesis, hypotheses
from ident.diagnosis.core.observations import Observation, observe
from ident.diagnosis.core.search import Search, State, price_of
from ident.diagnosis.delays import HELD, RARER
from ident.diagnosis.diagnosis import Diagnosis, Gap, NamedEffect, Verdict
from ident.diagnosis.findings import LAW
from ident.diagnosis.law.answer import Alternative, LawAnswer
from ident.diagnosis.names import EffectName
from ident.records.axis_record import AxisKind, AxisRecord
from ident.vehicle.quantities import Quantity

Array = NDArray[np.float64]

CREDIBLE: Final = 0.95
"""Probability that the names of a set have together."""

DOUBTED: Final = 0.5
"""Probability of nothing in its place from which a member is none."""

EXACT: Final = 0.01
"""Share of the held-out gap that a member must close beside others, whose columns are exact to about as much."""

PLACE: Final = "axis"


@dataclass(frozen=True)
class Slot:
    """What may stand in one place of the best set.

    Attributes:
        odds: probability by name; of nothing, by the empty name.
        first: the hypothesis with the largest evidence; None: a lag.
        variables: of the laws among them, the most probable first.
    """

    odds: Mapping[str, float]
    first: int | None
    variables: tuple[str, ...]

    @property
    def name(self) -> str:
        """The most probable one that is there."""
        return max((name for name in self.odds if name), key=lambda name: self.odds[name])

    @property
    def names(self) -> tuple[str, ...]:
        """Names that have CREDIBLE together of what there is, the most probable first."""
        there = {name: odds for name, odds in self.odds.items() if name}
        order = sorted(there, key=lambda name: -there[name])
        share = np.cumsum([there[name] for name in order]) / sum(there.values())
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
    design = Design(observations, tried)
    price = price_of(len(tried) + 2)
    search = Search(design, price)
    state = search.run()
    temper = temperature(state, len(fit))
    tempered = state.tempered(temper)
    slots = {index: _slot(tempered, index, price) for index in state.members}
    slots = {index: slot for index, slot in slots.items() if slot.odds[""] < DOUBTED}
    lag = _lag(search, tempered, price, lacking)
    late = _lag_slot(lag)
    led = late is not None and late.name == EffectName.TORQUE_FILTER
    found = fitted(state, len(fit), kind, led=led, lag=lag.beyond if late is not None else 0.0, temper=temper)
    there = {index: slot for index, slot in slots.items() if not found.closed[index] < EXACT or len(slots) == 1}
    effects = [_named(tried[index], slot, found, index) for index, slot in there.items()]
    if late is not None:
        effects.append(_late(late, lag, found))
    effects.sort(key=lambda effect: -effect.probability)
    verdict = Verdict.NONE
    if effects:
        verdict = Verdict.LAW if any(effect.name == LAW for effect in effects) else Verdict.EFFECT
    return Diagnosis(verdict, tuple(effects), (), found.gap, (), None)


def _slot(state: State, index: int, price: float) -> Slot:
    tables = state.slot(index)
    design = state.evidence.design
    logs = {number: table.total - price for number, table in tables.items()}
    whole = logsumexp([0.0, *logs.values()])
    odds = {"": math.exp(-whole)}
    for number, log in logs.items():
        name = design.hypotheses[number].name
        odds[name] = odds.get(name, 0.0) + math.exp(log - whole)
    laws = [number for number in logs if design.hypotheses[number].free]
    laws.sort(key=lambda number: -logs[number])
    variables = [str(design.hypotheses[number].function.variable) for number in laws if _near(logs, laws, number)]  # type: ignore[union-attr]
    return Slot(odds, index, tuple(dict.fromkeys(variables)))


def _near(logs: Mapping[int, float], laws: Sequence[int], number: int) -> bool:
    """Whether a law is among those that the records do not tell from the best one."""
    return logs[number] - max(logs[law] for law in laws) > math.log(1 - CREDIBLE)


def _lag(search: Search, state: State, price: float, lacking: Collection[str]) -> Lag:
    """Lag beside a set; what makes it is sampling, a delay, a filter in the drive, or another filter of the load."""
    mean, covariance = state.evidence.plant_parameters(state.members)
    one = state.evidence.design.observations[0]
    value, std = one.lag + float(mean[4]), math.sqrt(float(covariance[4, 4]))
    widest = HELD * one.sample_time
    inside = norm.logcdf(widest, value, std) + math.log1p(-math.exp(min(norm.logcdf(-widest, value, std) - norm.logcdf(widest, value, std), -1e-12)))
    outside = logsumexp([norm.logsf(widest, value, std), norm.logcdf(-widest, value, std)])
    longest = 2 * math.pi / one.filter.bandwidth
    sampled = inside - math.log(2 * widest)
    late = outside - math.log(2 * longest) - price - sampled
    odds: dict[str, float] = {}
    if EffectName.TIME_DELAY not in lacking:
        odds[EffectName.TIME_DELAY] = late
    if EffectName.TORQUE_FILTER not in lacking:
        odds[EffectName.TORQUE_FILTER] = late - RARER + search.led(state).log_evidence - state.log_evidence
    filters = [i for i, each in enumerate(search.design.hypotheses) if each.function is FILTER]
    if filters and filters[0] not in state.members:
        odds[LAW] = late + state.evidence.table(filters[0], state.members).total
    return Lag(value, std, widest, odds)


def _lag_slot(lag: Lag) -> Slot | None:
    """None where sampling explains the lag."""
    whole = logsumexp([0.0, *lag.odds.values()])
    odds = {name: math.exp(log - whole) for name, log in lag.odds.items()}
    if sum(odds.values()) < 0.5:
        return None
    return Slot({"": math.exp(-whole), **odds}, None, ("load_rate",))


def _named(hypothesis: Hypothesis, slot: Slot, found: Fit, index: int) -> NamedEffect:
    name = slot.name
    law = None
    alternatives: tuple[Alternative, ...] = ()
    if name == LAW and hypothesis.function is not None:
        law = found.laws[index]
        alternatives = tuple(Alternative(None, one, PLACE) for one in slot.variables if one != law.variable)
    return NamedEffect(
        name=name,
        where=PLACE,
        parameters=found.parameters.get(index, {}),
        probability=round(slot.odds[name], 2),
        ambiguity_set=slot.names,
        gap_closed_held_out=found.closed[index],
        alternatives=alternatives,
        law=law,
    )


def _late(slot: Slot, lag: Lag, found: Fit) -> NamedEffect:
    name = slot.name
    word = {EffectName.TIME_DELAY: "delay", EffectName.TORQUE_FILTER: "time"}.get(EffectName(name) if name != LAW else EffectName.PAYLOAD)
    parameters = {} if word is None else {word: Quantity(lag.value, "s", "diagnosis", lag.std)}
    law = None
    if name == LAW:
        law = LawAnswer("load_rate", "", "", "dynamic", None, "", "", np.zeros((0, 3)), None, None, None)
    return NamedEffect(name, PLACE, parameters, round(slot.odds[name], 2), slot.names, found.gap.closed, (), law)
