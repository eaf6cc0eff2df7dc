"""Every command that writes, on a disk that is full before it is done: no half file, a clear error, exit code 2."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hil.campaign.folder import Run
from hil.frames import decode_log
from hil.frames.recorder import PARTIAL, finished_steps
from hil.network import load_network
from ident.campaign.steps import ORDER
from ident.records.record import Step

STEPS = tuple(step for step in ORDER if step is not Step.LATERAL)

WRITING = {
    "identify": "identify {run} --out {disk}",
    "report": "report {run} --out {disk}/report.html",
    "diagnose --json": "diagnose {run} --json {disk}/diagnosis.json",
    "diagnose --report": "diagnose {run} --report {disk}/report.html",
    "fmu": "fmu {run} --platforms host -o {disk}/platform.fmu",
    "cosim": "cosim {fmu} --record {run} --out {disk}/plot.html",
    "safety": "safety --json {disk}/report.json",
    "exam seal": "exam seal --out {disk}/exam --first-seed 1 --effects 1 --pairs 0 --none 0 --unknown 0 --invisible 0 "
    "--excitations 1 --jobs 1",
}
"""What writes a file or two; the rest is in `test_files_of_users`, where a campaign is not needed first."""

RECORDING = {
    "campaign": "campaign --out {disk}/run --b-w 0.12 --b-w-std 0.01 --skip straight --skip rotation "
    "--skip lane_change",
    "demo": "demo --out {disk}/run",
}


@pytest.fixture(scope="module")
def run(drive: Callable[..., Run], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "run"
    drive(folder, STEPS)
    for line in ("identify {run}", "fmu {run} --platforms host -o {run}/platform.fmu"):
        subprocess.run(quasiomni(line.format(run=folder)), check=True, capture_output=True)
    return folder


def quasiomni(line: str) -> list[str]:
    return [sys.executable, "-m", "quasiomni", *line.split()]


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """A file system of so many KiB; who may not mount one has none."""
    place = tmp_path / "disk"
    place.mkdir()

    def mounted(size: int) -> Path:
        mount = ["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", str(place)]
        if subprocess.run(mount, capture_output=True, check=False).returncode:
            pytest.skip("mounting needs root")
        return place

    yield mounted
    subprocess.run(["umount", "--lazy", str(place)], check=False, capture_output=True)


def assert_refused(done: subprocess.CompletedProcess[Any]) -> None:
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert "No space left on device" in done.stderr
    assert "remedy:" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("line", WRITING.values(), ids=WRITING)
def test_no_room_for_a_file(run: Path, disk: Callable[[int], Path], line: str) -> None:
    place = disk(4)
    (place / "filler").write_bytes(bytes(100))
    arguments = line.format(run=run, fmu=run / "platform.fmu", disk=place)
    done = subprocess.run(quasiomni(arguments), capture_output=True, text=True, check=False)
    assert_refused(done)
    assert [path.name for path in place.rglob("*") if path.is_file()] == ["filler"]


@pytest.mark.slow
@pytest.mark.parametrize("line", RECORDING.values(), ids=RECORDING)
def test_a_disk_that_fills_up_while_it_drives(disk: Callable[[int], Path], tmp_path: Path, line: str) -> None:
    """Finished logs stay, the running one keeps its mark, and with room again the campaign goes on."""
    place = disk(1000)
    command = quasiomni(line.format(disk=place))
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert_refused(done)
    logs = sorted(path.name for path in (place / "run" / "frames").iterdir())
    assert [name for name in logs if PARTIAL in name]
    for step, path in finished_steps(place / "run" / "frames"):
        assert len(decode_log(path, load_network()).time) > 1000, step
    moved = tmp_path / "roomy"
    shutil.copytree(place / "run", moved)
    kept = {path.name: path.read_bytes() for path in (moved / "frames").iterdir()}
    if "campaign" in command:
        resumed = quasiomni(line.replace("{disk}/run", str(moved)) + " --resume")
        gone_on = subprocess.run(resumed, capture_output=True, text=True, check=False)
        assert gone_on.returncode == 0, gone_on.stderr
        now = {path.name: path.read_bytes() for path in (moved / "frames").iterdir()}
        assert kept.items() <= now.items()
