"""The same corruptions in records decoded from the frames of a whole campaign on the emulator."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from hil.campaign.reading import read_driven
from ident.campaign.steps import ORDER
from ident.faults import find_faults
from ident.records.record import Step


@pytest.mark.slow
@pytest.mark.parametrize("name", ["prototype", "compact"])
def test_a_sound_campaign_has_no_fault_and_nine_of_ten_corruptions_are_named(
    drive: Callable[..., Any], corruptions: Sequence[Any], tmp_path: Path, name: str
) -> None:
    steps = [step for step in ORDER if step is not Step.LATERAL]
    run = drive(tmp_path / name, steps, vehicle=name, seed=11)
    record, vehicle = read_driven(run), run.plan.vehicle
    assert find_faults(record, vehicle) == ()
    missed = []
    for corruption in corruptions:
        found = find_faults(corruption.apply(record), vehicle)[:1]
        names = {name for fault in found for name in (f"{fault.name}@{fault.channel}", *fault.also)}
        if not any(f"{corruption.name}@{corruption.channel}" == name.split(" in ")[0] for name in names):
            missed.append(str(corruption))
    assert len(missed) <= 0.1 * len(corruptions), missed
