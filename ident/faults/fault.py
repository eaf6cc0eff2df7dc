"""A fault of a record: what is wrong with which channel, how large, and how sure that is."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any, Final

from ident.writing import json_number


class FaultName(enum.StrEnum):
    """Canonical names of what can be wrong with a record."""

    SWAPPED = "channel_swapped"
    NEGATED = "sign_flipped"
    SCALED = "scaled"
    FROZEN = "frozen"
    CLIPPED = "clipped"
    WRAPPED = "wrapped"
    LATE = "unsynchronised"
    LOST = "lost_samples"


@dataclass(frozen=True)
class Fault:
    """A fault that was found.

    Attributes:
        name: what is wrong.
        channel: canonical channel; two with a slash between them where they are swapped; `torque`, `beta`, `alpha` for
            a whole group.
        value: factor of `scaled`, lateness [s] of `unsynchronised`, level of `clipped` and `frozen`, modulus of
            `wrapped`, number of missing samples of `lost_samples`; NaN where the name says everything.
        unit: of the value.
        std: standard uncertainty of the value, in its unit; NaN where there is none.
        evidence: log posterior odds against a sound record, all that was searched through allowed for.
        undo_fits: the record with the fault undone fits rolling and balance of forces.
        also: other names that the same record may bear, as `name@place`.
        step: the step that it is confined to; empty where it is in all of them.
    """

    name: FaultName
    channel: str
    value: float = math.nan
    unit: str = ""
    std: float = math.nan
    evidence: float = 0.0
    undo_fits: bool = False
    also: tuple[str, ...] = ()
    step: str = ""

    def as_json(self) -> dict[str, Any]:
        """Plain values, numbers that JSON can hold."""
        return {
            "name": str(self.name),
            "channel": self.channel,
            "value": json_number(self.value),
            "unit": self.unit,
            "std": json_number(self.std),
            "evidence": json_number(self.evidence),
            "undo_fits": self.undo_fits,
            "also": list(self.also),
            "step": self.step,
        }

    @property
    def sure(self) -> bool:
        """Whether the record is at fault by this and not by something else that looks like it.

        What is undone must fit; what cannot be undone, because the values are not there, need not.
        """
        return self.undo_fits or self.name in (FaultName.FROZEN, FaultName.CLIPPED, FaultName.LOST)

    @property
    def text(self) -> str:
        """What is wrong, in words."""
        sentence = _TEXTS[self.name].format(
            channel=self.channel.replace("/", " and "),
            value=f"{self.value:.4g}",
            milliseconds=f"{abs(self.value) * 1e3:.1f}",
            sense="late" if self.value > 0 else "early",
            unit=self.unit,
            samples=f"{self.value:.0f}",
        )
        return f"{sentence} in step {self.step}" if self.step else sentence

    @property
    def remedy(self) -> str:
        """What to do about it, a sentence."""
        return _REMEDIES[self.name].format(channel=self.channel.replace("/", " and "))


_TEXTS: Final = {
    FaultName.SWAPPED: "{channel} are swapped",
    FaultName.NEGATED: "{channel} has the wrong sign",
    FaultName.SCALED: "{channel} is {value} times what it should be",
    FaultName.FROZEN: "{channel} stands still at {value} {unit} while the vehicle moves",
    FaultName.CLIPPED: "{channel} is clipped at {value} {unit}",
    FaultName.WRAPPED: "{channel} jumps by {value} {unit} where its counter wraps",
    FaultName.LATE: "{channel} is {milliseconds} ms {sense}",
    FaultName.LOST: "{samples} samples are missing",
}

_REMEDIES: Final = {
    FaultName.SWAPPED: "Name the columns, or the nodes in the network file, the other way round.",
    FaultName.NEGATED: "Turn the sign of {channel}, or its direction in the network file.",
    FaultName.SCALED: "Check the unit of {channel}: records are in s, rad and Nm at the motor shaft.",
    FaultName.FROZEN: "Check the sensor, the cable and the mapping of {channel}, and drive again.",
    FaultName.CLIPPED: "Widen the range in which {channel} is transmitted, and drive again.",
    FaultName.WRAPPED: "Unwrap {channel} before it is written.",
    FaultName.LATE: "Shift {channel} in time, or record all channels by one clock.",
    FaultName.LOST: "Drive that step again, or cut the record there and give both sides names of their own.",
}
