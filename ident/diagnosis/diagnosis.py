"""The answer: what causes the gap, how sure that is, and what to do next; as a value and as JSON."""

from __future__ import annotations

import enum
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.faults import Fault
from ident.vehicle.quantities import Quantity
from ident.writing import json_number, write_whole


class Verdict(enum.StrEnum):
    """A named effect, a law without a name, no gap above the noise, a gap without either, or a record at fault."""

    EFFECT = "effect"
    LAW = "law"
    NONE = "none"
    UNKNOWN = "unknown"
    FAULT = "fault"

    @property
    def explains(self) -> bool:
        """Whether causes are part of the answer."""
        return self in (Verdict.EFFECT, Verdict.LAW)


@dataclass(frozen=True)
class LawAnswer:
    """A law as it is written down.

    Attributes:
        variable: what it is a function of.
        partner: what the function is multiplied with: `direction`, `rate`, `acceleration`; empty: nothing.
        of: whose motion, where that is not the place's own.
        channel: of the rows in which it was found.
        period: after which it comes around, in `unit_x`; None where it does not.
        unit_x, unit_y: of the variable and of the function.
        curve: (k, 3) variable, function, standard deviation.
        formula: one that does as well as the curve; None where none that is short does.
        nearest: effect of the library that comes nearest, with its place; None where none is near.
        distance: share of what the law adds that the nearest effect cannot, as an rms.
        unrecorded: of what else that the records do not have it may be a function, an alternative; None: nothing.
    """

    variable: str
    partner: str
    of: str
    channel: str
    period: float | None
    unit_x: str
    unit_y: str
    curve: NDArray[np.float64]
    formula: str | None
    nearest: str | None
    distance: float | None
    unrecorded: str | None = None

    def as_json(self) -> dict[str, Any]:
        """Plain values; what does not apply is null."""
        return {
            "variable": self.variable,
            "with": self.partner or None,
            "of": self.of or None,
            "channel": self.channel,
            "period": json_number(self.period) if self.period is not None else None,
            "unit_x": self.unit_x,
            "unit_y": self.unit_y,
            "curve": [[json_number(value) for value in point] for point in self.curve.tolist()],
            "formula": self.formula,
            "nearest": self.nearest,
            "distance": json_number(self.distance) if self.distance is not None else None,
        }


@dataclass(frozen=True)
class Alternative:
    """What these records do not tell from a cause: an effect by name, or a law by variable, and where."""

    name: str | None
    variable: str | None
    where: str

    def as_json(self) -> dict[str, str]:
        """The name or the variable, and the place."""
        what = {"name": self.name} if self.name is not None else {"variable": self.variable or ""}
        return {**what, "where": self.where}


@dataclass(frozen=True)
class NamedEffect:
    """A cause that is part of the answer.

    Attributes:
        name, where: canonical.
        parameters: value, standard uncertainty and unit by name.
        probability: that this name is right, or one that is the same in these records.
        ambiguity_set: names that these records do not tell apart from it, itself first.
        gap_closed_held_out: share of the removable gap that this effect closes on records that took no part in the
            fit, given the other effects.
        alternatives: what adds the same to these records, and where else it may be; the cause itself left out.
        law: of a law, which has no name but `law`.
    """

    name: str
    where: str
    parameters: Mapping[str, Quantity]
    probability: float
    ambiguity_set: tuple[str, ...]
    gap_closed_held_out: float
    alternatives: tuple[Alternative, ...] = ()
    law: LawAnswer | None = None

    @property
    def elsewhere(self) -> tuple[str, ...]:
        """Other places where an effect with this name may be."""
        return tuple(other.where for other in self.alternatives if other.name == self.name)


@dataclass(frozen=True)
class Share:
    """Part of the gap's power that lies in one place; the shares of region `all` sum to one.

    Attributes:
        channel, step, coordinate: which rows.
        region: `all`, or a part of those rows.
        share: of the power of the whole gap above the floor [-].
        power: that is, over that of the noise of a sample, as far as it is known.
    """

    channel: str
    step: str
    coordinate: str
    region: str
    share: float
    power: float = 0.0


@dataclass(frozen=True)
class Gap:
    """Rms difference of model and measurement on held-out rows, each row over the rms of what its coordinate measures.

    Attributes:
        before: of the model without the effects.
        after: with them, everything refitted jointly.
        floor: noise, which no model can remove.
        samples: whose rms it is, as far as that is known.
    """

    before: float
    after: float
    floor: float
    samples: int = 0

    @property
    def closed(self) -> float:
        """Share of the removable gap that is gone: 1 - (after² - floor²)/(before² - floor²); 0 where none was."""
        removable = self.before**2 - self.floor**2
        return 1 - (self.after**2 - self.floor**2) / removable if removable > 0 else 0.0


@dataclass(frozen=True)
class Unseen:
    """The gap of one channel in whole steps that took no part in the fit.

    Attributes:
        steps: `repeated` for those that the diagnosis compares, `lane_change`.
        channel: kinematic, dynamic or outcome.
        gap: in units of the noise.
    """

    steps: str
    channel: str
    gap: Gap


@dataclass(frozen=True)
class Diagnosis:
    """The content of `diagnosis.json`, which other programs read and which therefore stays as it is.

    Attributes:
        verdict: what kind of answer it is.
        effects: by probability, most probable first; empty unless the verdict is `effect` or `law`.
        where: shares of the gap, largest first.
        gap: on held-out rows.
        invisible: names of effects that these records cannot show anywhere.
        next_experiment: what would split an ambiguity or show what is invisible; None where nothing would.
        unseen: gap by channel (kinematic, dynamic, outcome) of whole records that took no part in the fit; empty where
            there is no model to simulate.
        faults: of the records; where there are any the verdict is `fault`, and nothing else was looked at.
    """

    verdict: Verdict
    effects: tuple[NamedEffect, ...]
    where: tuple[Share, ...]
    gap: Gap
    invisible: tuple[str, ...]
    next_experiment: str | None
    unseen: tuple[Unseen, ...] = ()
    faults: tuple[Fault, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Plain values, numbers that JSON can hold."""
        gap = {name: json_number(getattr(self.gap, name)) for name in ("before", "after", "floor", "closed")}
        return {
            "verdict": str(self.verdict),
            "effects": [_effect(effect) for effect in self.effects],
            "where": [_share(share) for share in self.where],
            "gap": gap,
            "invisible": list(self.invisible),
            "next_experiment": self.next_experiment,
            "faults": [fault.as_json() for fault in self.faults],
            "unseen": [_unseen(one) for one in self.unseen],
        }


def faulty(faults: Sequence[Fault]) -> Diagnosis:
    """The answer where the records are at fault: whatever effects they seem to show are not asked for."""
    nothing = Gap(math.nan, math.nan, math.nan)
    return Diagnosis(Verdict.FAULT, (), (), nothing, (), faults[0].remedy, faults=tuple(faults))


def write_diagnosis(diagnosis: Diagnosis, path: Path) -> None:
    """Write the file whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(json.dumps(diagnosis.as_json(), indent=2, allow_nan=False) + "\n", path)


def _share(one: Share) -> dict[str, Any]:
    places = {name: getattr(one, name) for name in ("channel", "step", "coordinate", "region")}
    return {**places, "share": json_number(one.share)}


def _unseen(one: Unseen) -> dict[str, Any]:
    gap = {name: json_number(getattr(one.gap, name)) for name in ("before", "after", "floor")}
    return {"step": one.steps, "channel": one.channel, **gap}


def _effect(effect: NamedEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "where": effect.where,
        "parameters": {
            name: {"value": json_number(quantity.value), "std": json_number(quantity.std), "unit": quantity.unit}
            for name, quantity in effect.parameters.items()
        },
        "probability": json_number(effect.probability),
        "ambiguity_set": list(effect.ambiguity_set),
        "gap_closed_held_out": json_number(effect.gap_closed_held_out),
        "alternatives": [other.as_json() for other in effect.alternatives],
        "law": None if effect.law is None else effect.law.as_json(),
    }
