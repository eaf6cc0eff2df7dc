"""What the record of a campaign says by itself, without a model and without another record to confirm."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from hil.campaign.folder import Run
from hil.campaign.reading import read_run
from ident.campaign.steps import ORDER
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.records.record import Step


@pytest.mark.slow
@pytest.mark.parametrize(("vehicle", "seed"), [("prototype", 1), ("prototype", 5), ("compact", 1)])
def test_a_plain_vehicle_lacks_nothing(drive: Callable[..., Run], tmp_path: Path, vehicle: str, seed: int) -> None:
    """Its contacts give way where it turns fastest, once in every repeat: that is no law of whatever passes then.

    Of the prototype with seed 1, which `quasiomni demo` drives, the turn of the wheels was one.
    """
    steps = tuple(step for step in ORDER if step is not Step.LATERAL)
    run = drive(tmp_path / "run", steps, vehicle=vehicle, seed=seed)
    findings = diagnose_vehicle([read_run(run.folder.path)], [], run.plan.vehicle).findings
    assert findings.verdict is Verdict.NONE
