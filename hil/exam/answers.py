"""What the diagnosing side said of every case, beside the truth, and what of it is right."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final

from hil.exam.cases import Case, Injected, Kind
from hil.exam.identity import Identity
from hil.exam.said import Said
from hil.exam.statistics import Z95
from ident.diagnosis.axis.functions import function_of
from ident.diagnosis.names import LAW
from ident.diagnosis.vehicle.causes.library import DRIFTS, SHAPES
from ident.plant.places import OF_PARAMETERS

CONFIDENT: Final = 0.5
"""Probability from which on a single name counts as a confident one."""


ALIKE: Final = 0.98
"""Cosine of what two causes add to the records, from which they count as the same."""

LAW_VARIABLES: Final = MappingProxyType(
    {"law_rate": "rate", "law_angle": "angle", "law_angle_direction": "angle", "law_angle_rate": "angle"}
)
"""Laws that an exam draws -> on what they depend."""

_JOINTS: Final = MappingProxyType({"drive": "wheel", "drives": "wheels", "encoder": "steering", "encoders": "steering"})
"""A drive turns the wheel of its corner, an encoder reads the steering axis of its side."""

_TURNED: Final = frozenset(str(name) for name, shape in SHAPES.items() if shape.angle is not None)
"""Effects with a direction or a phase: half a turn of it is the other sign of the size."""

_SPECIAL: Final = MappingProxyType({Kind.INVISIBLE: " (invisible)", Kind.UNKNOWN: " (no candidate)"})

_VERDICTS: Final = MappingProxyType(
    {Kind.NONE: "none", Kind.INVISIBLE: "none", Kind.UNKNOWN: "unknown", Kind.LAW: "law", Kind.FAULT: "fault"}
)


@dataclass(frozen=True)
class Answer:
    """What was said of a case beside its truth.

    Attributes:
        case: with the truth.
        said: about it, or, in a permuted exam, about another.
        identities: of the case's effects: what no record can tell from them.
    """

    case: Case
    said: Said
    identities: tuple[Identity, ...]

    @property
    def named(self) -> str | None:
        """The name put first."""
        return str(self.said.effects[0]["name"]) if self.said.effects else None

    @property
    def ambiguity_set(self) -> frozenset[str]:
        """Names that the answer does not tell apart; empty without a name."""
        return _set(self.said.effects[0]) if self.said.effects else frozenset()

    @property
    def probability(self) -> float:
        """Of the name put first."""
        return float(self.said.effects[0]["probability"]) if self.said.effects else 0.0

    @property
    def truth(self) -> str:
        """The true names, with what is special about them, or the kind of a case without any."""
        names = " + ".join(sorted(effect.name for effect in self.case.effects)) or str(self.case.kind)
        return names + _SPECIAL.get(self.case.kind, "")

    @property
    def wished(self) -> str:
        """What a perfect diagnosis would put first, where the case has at most one effect."""
        return self.single.name if self.case.kind is Kind.EFFECT else _VERDICTS[self.case.kind]

    @property
    def single(self) -> Injected:
        """The one effect of the case."""
        return self.case.effects[0]

    @property
    def identity(self) -> Identity:
        """Of the one effect."""
        return self.identities[0]

    @property
    def splits_name(self) -> bool:
        """Whether the experiment can tell the true name from every other."""
        return len(self.identity.names) == 1

    @property
    def splits_place(self) -> bool:
        """Whether the experiment can tell the true place from every other place of the name."""
        return len(self.identity.places) == 1

    @property
    def exact(self) -> bool:
        """The name put first is the true one."""
        return self.named == self.single.name

    @property
    def right(self) -> bool:
        """The name put first is the true one; where no record can split it from others, the set is exactly those."""
        return self.exact if self.splits_name else self.ambiguity_set == self.identity.names

    @property
    def covered(self) -> bool:
        """The true name is in the set."""
        return self.single.name in self.ambiguity_set

    @property
    def alone_right(self) -> bool:
        """Nothing beside the right name is named."""
        return self.right and len(self.said.effects) == 1

    @property
    def where(self) -> str:
        """Place of the effect put first."""
        return str(self.said.effects[0]["where"])

    @property
    def place(self) -> bool:
        """The true name at the true place."""
        return self.exact and self.where == self.single.where

    @property
    def like_place(self) -> bool:
        """The true name, at a place that no record can split from the true one."""
        return self.exact and self.where in self.identity.places

    @property
    def size_held(self) -> bool | None:
        """The true size is in the 95 % interval; None where the answer is of another effect or place.

        Of an effect with a direction or phase, half a turn of which is the other sign, the amount is compared.
        """
        if not self.like_place:
            return None
        stated = self.said.effects[0]["parameters"].get(self.single.parameter)
        if stated is None or stated["value"] is None or stated["std"] is None:
            return False
        value, true = float(stated["value"]), self.single.size
        if self.single.name in _TURNED:
            value, true = abs(value), abs(true)
        return abs(value - true) <= Z95 * float(stated["std"])

    @property
    def both(self) -> bool:
        """Every effect of the case is named, by an entry of its own: as `right` asks of a single one."""
        found = [
            {number for number, identity in enumerate(self.identities) if _names(effect, self.case, number, identity)}
            for effect in self.said.effects
        ]
        return _matched(range(len(self.case.effects)), found)

    @property
    def both_covered(self) -> bool:
        """Every effect of the case is named or in the set of an entry of its own."""
        found = [
            {number for number, effect in enumerate(self.case.effects) if effect.name in _set(entry)}
            for entry in self.said.effects
        ]
        return _matched(range(len(self.case.effects)), found)

    @property
    def rejected(self) -> bool:
        """The answer is that nothing in the library explains the gap: `unknown`, or laws without a name alone."""
        laws = [effect["name"] == LAW for effect in self.said.effects]
        return self.said.verdict == "unknown" or (bool(laws) and all(laws))

    @property
    def unseen(self) -> bool:
        """The effect is said to be invisible, and not named."""
        name = self.single.name
        return name in self.said.invisible and name not in {effect["name"] for effect in self.said.effects}

    @property
    def open(self) -> bool:
        """The answer is `unknown`, or laws, or every effect that is named comes as a set."""
        sets = [effect["name"] == LAW or len(_set(effect)) > 1 for effect in self.said.effects]
        return self.rejected or (bool(sets) and all(sets))

    @property
    def modest(self) -> bool:
        """No confident single name; a law has none."""
        named = [effect for effect in self.said.effects if effect["name"] != LAW]
        return all(len(_set(effect)) > 1 or effect["probability"] < CONFIDENT for effect in named)

    def near(self, closed: float = 1.0) -> bool:
        """All that is named is at the joint of the case, and closes all but what a cosine of ALIKE leaves.

        Args:
            closed: what the true cause closes of the same gap, as noise has it.
        """
        there = [_corner(str(effect["where"])) == _corner(self.single.where) for effect in self.said.effects]
        return bool(there) and all(there) and self.said.closed >= ALIKE**2 * min(closed, 1.0)

    @property
    def fault_named(self) -> bool:
        """The fault of the records is the one named first, or what the record bears as well."""
        return bool(self.said.faults) and f"{self.single.name}@{self.single.where}" in self.said.faults[0]

    @property
    def law_place(self) -> bool:
        """The law is put where it is, or where these records do not tell it from."""
        return any(_corner(where) == _corner(self.single.where) for where in self._places)

    @property
    def law_variable(self) -> bool:
        """The law is said to depend on what it does, or on what these records do not tell from it.

        A name is as good where it closes all but what a cosine of ALIKE leaves: the shape drawn is near one. So are
        several, where each is a function of that variable at that place, and together they close as much.
        """
        if not self.said.effects:
            return False
        first, variable = self.said.effects[0], LAW_VARIABLES[self.single.name]
        if first.get("law") is None:
            near = float(first["gap_closed_held_out"] or 0.0) >= ALIKE**2
            return self.law_place and (near or (self.said.closed >= ALIKE**2 and self._all_over(variable)))
        told = {first["law"]["variable"], *(other.get("variable") for other in first.get("alternatives", ()))}
        return self.law_place and variable in told

    def _all_over(self, variable: str) -> bool:
        """Whether every name is a function of that variable, at the joint of the case."""
        functions = [function_of(str(effect["name"])) for effect in self.said.effects]
        there = all(_corner(str(effect["where"])) == _corner(self.single.where) for effect in self.said.effects)
        return there and all(over is not None and over[0] == variable for over in functions)

    @property
    def _places(self) -> list[str]:
        if not self.said.effects:
            return []
        first = self.said.effects[0]
        return [str(first["where"]), *(str(other["where"]) for other in first.get("alternatives", ()))]

    @property
    def statements(self) -> list[tuple[float, bool]]:
        """Every probability stated, and whether a true effect has that name, or one that no record tells from it.

        Of an effect that the library lacks, a law without a name is right.
        """
        if self.case.kind is Kind.LAW:
            right = self.law_variable
            return [(float(effect["probability"]), right or effect["name"] == LAW) for effect in self.said.effects]
        nameless = self.case.kind is Kind.UNKNOWN
        known = [frozenset({LAW})] if nameless else [identity.names for identity in self.identities]
        return [
            (float(effect["probability"]), any(effect["name"] in names for names in known))
            for effect in self.said.effects
        ]

    @property
    def closed(self) -> float:
        """Share of the removable held-out gap that the effect put first closes."""
        if len(self.said.effects) == 1:
            return self.said.closed
        stated = self.said.effects[0]["gap_closed_held_out"] if self.said.effects else None
        return math.nan if stated is None else float(stated)

    @cached_property
    def closed_wrong(self) -> Mapping[str, float]:
        """Share that every name closes which is not the true one, nor identical to it, in place of the answer.

        Where a value of the model has changed, with the parameters held at the model's values, for a refit of all of
        them would close the gap by itself; otherwise with the parameters refitted.
        """
        drift = self.single.name in DRIFTS
        found = {one.name: one.held if drift else one.refitted for one in self.said.alone}
        wrong = {name: value for name, value in found.items() if name not in self.identity.names}
        return MappingProxyType({name: value for name, value in wrong.items() if math.isfinite(value)})


def _corner(where: str) -> str:
    """The joint that a place, or a parameter of the model, is at."""
    kind, mark, corner = OF_PARAMETERS.get(where, where).partition("_")
    return f"{_JOINTS.get(kind, kind)}{mark}{corner}"


def _set(effect: Mapping[str, Any]) -> frozenset[str]:
    return frozenset((effect["name"], *effect["ambiguity_set"]))


def _names(effect: Mapping[str, Any], case: Case, number: int, identity: Identity) -> bool:
    if len(identity.names) == 1:
        return bool(effect["name"] == case.effects[number].name)
    return _set(effect) == identity.names


def _matched(wanted: Sequence[int], found: Sequence[set[int]]) -> bool:
    """Whether every number can be given an entry of its own that has it."""
    if not wanted:
        return True
    first, *others = wanted
    return any(
        first in each and _matched(others, [*found[:index], *found[index + 1 :]]) for index, each in enumerate(found)
    )
