"""Whether a step that was driven can be used, asked while the vehicle still stands there and can drive it again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hil.campaign.folder import Run
from hil.campaign.reading import segment_of
from hil.frames import decode_log
from hil.frames.recorder import set_aside
from ident.errors import CampaignError, RecordError
from ident.records.record import Step


@dataclass(frozen=True)
class Rejected:
    """A step that has to be driven again.

    Attributes:
        step: by name.
        log: where its log is kept.
        error: why it cannot be used.
    """

    step: str
    log: Path
    error: RecordError


def reject_unusable(run: Run, logs: Iterable[tuple[str, Path]]) -> list[Rejected]:
    """Decode logs as the estimate will; those that cannot be used get a name that says so, and count as not driven.

    Raises:
        RecordError: a log cannot be renamed.
    """
    rejected = []
    for step, path in logs:
        try:
            segment_of(step, path, decode_log(path, run.network), run.network, run.plan)
        except RecordError as error:
            rejected.append(Rejected(step, set_aside(path), error))
    return rejected


def refusal(rejected: Iterable[Rejected]) -> CampaignError | None:
    """What is to be said of steps that have to be driven again; None where there are none.

    An alignment is not among them: it is driven anew before every step, and nothing is estimated from it.
    """
    steps = [one for one in rejected if one.step != Step.ALIGNMENT]
    if not steps:
        return None
    reasons = " ".join(f"{one.step}: {one.error.what}" for one in steps)
    return CampaignError(
        f"{', '.join(one.step for one in steps)} cannot be used. {reasons}",
        f"{steps[0].error.remedy} It is driven again by --resume; its log is kept as {steps[0].log}.",
    )
