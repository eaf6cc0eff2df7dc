"""Several files of one campaign are one record, two campaigns are two."""

from __future__ import annotations

import numpy as np

from hil.campaign.reading import whole_records
from ident.records.record import Record, Segment, Step


def log(step: str, source: str) -> Record:
    still = np.zeros((20, 4))
    time = np.arange(20) * 0.002
    return Record([Segment(step, 0.002, time, still, still, still[:, :2], np.full(20, -1))], source)


def test_the_logs_of_two_campaigns_are_two_records() -> None:
    """An alignment comes before every step, so that its repetition begins no new campaign."""
    steps = (Step.STEERING_LEFT, Step.ALIGNMENT, Step.STRAIGHT, Step.ALIGNMENT, Step.ROTATION)
    logs = [log(step, f"{day}/{number}_{step}") for day in ("monday", "tuesday") for number, step in enumerate(steps)]
    found = whole_records(logs)
    assert [record.steps for record in found] == [list(dict.fromkeys(steps))] * 2
    assert [len(record.segments) for record in found] == [5, 5]


def test_whole_records_stay_what_they_are() -> None:
    one, other = log(Step.STRAIGHT, "one"), log(Step.STRAIGHT, "other")
    assert [record.source for record in whole_records([one, other])] == ["one", "other"]
