"""What the record of a campaign says by itself, without a model and without another record to confirm."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hil.campaign.folder import open_run
from hil.campaign.reading import read_run
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle


@pytest.mark.slow
def test_the_vehicle_of_the_demo_lacks_nothing(tmp_path: Path) -> None:
    """Its contacts give way where it turns fastest, once in every repeat: that is no law of the turn of its wheels."""
    folder = tmp_path / "run"
    command = [sys.executable, "-m", "quasiomni", "demo", "--out", str(folder), "--engine", "pybullet"]
    driven = subprocess.run(command, capture_output=True, text=True, timeout=1800, check=False)
    assert driven.returncode == 0, driven.stderr
    findings = diagnose_vehicle([read_run(folder)], [], open_run(folder).plan.vehicle).findings
    assert findings.verdict is Verdict.NONE
