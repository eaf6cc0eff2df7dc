"""The public Python interface: what docs/python.md prints runs, in the order in which it is printed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import quasiomni
from ident.diagnosis.vehicle.experiment.ideal import DIAGNOSTIC, FOUR, ideal_record
from ident.records.files import write_record
from ident.vehicle.description import load_vehicle

PAGE = Path(__file__).parents[2] / "docs" / "python.md"
LIFTED = DIAGNOSTIC["wheels lifted"].drives


def test_the_page_runs_as_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = load_vehicle()
    write_record(ideal_record((*LIFTED, *FOUR), vehicle), tmp_path / "record.parquet")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for code in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL):
        exec(compile(code, str(PAGE), "exec"), names)
    result = names["result"]
    np.testing.assert_allclose(result.values, vehicle.prior.values, rtol=0.02)
    assert (tmp_path / "platform.fmu").is_file()
    printed = capsys.readouterr().out
    assert "m_ch" in printed
    assert "weighted least squares" in printed


def test_every_name_is_on_the_page_and_documented() -> None:
    text = PAGE.read_text()
    for name in quasiomni.INTERFACE:
        assert f"`{name}" in text or f"qo.{name}" in text or f"quasiomni.{name}`" in text, name
        assert getattr(quasiomni, name).__doc__


def test_importing_the_package_loads_none_of_it() -> None:
    code = "import sys, quasiomni; print([m for m in ('numpy', 'casadi', 'can', 'typer') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("path", ["nowhere", "nowhere.csv", "README"])
def test_wrong_paths_are_refused_with_a_remedy(path: str, tmp_path: Path) -> None:
    with pytest.raises(quasiomni.UserError) as caught:
        quasiomni.read_record(tmp_path / path)
    assert caught.value.remedy
