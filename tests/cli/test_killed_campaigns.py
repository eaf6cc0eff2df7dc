"""`kill -9` at any moment of a campaign: what was finished stays byte for byte, and the campaign goes on to its end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest

from hil.bench.truth import truth_of
from hil.campaign.folder import open_run
from hil.campaign.reading import read_run
from hil.frames.recorder import finished_steps
from ident.campaign.steps import ORDER
from ident.estimate.identify import FIT_STEPS, identify
from ident.records.record import Step

GIVEN_INERTIA = ("--b-w", "0.121", "--b-w-std", "0.001")
KILLS = 20
LONGEST = 600.0
"""Until the first frame is written [s]; a busy machine is no failure."""


def campaign(out: Path, *more: str) -> list[str]:
    left_out = [step for step in ORDER if step not in FIT_STEPS and step is not Step.WHEEL_LIFTED]
    skips = [word for step in left_out for word in ("--skip", str(step))]
    return [sys.executable, "-m", "quasiomni", "campaign", "--out", str(out), *GIVEN_INERTIA, *skips, *more]


def finished(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for _, path in finished_steps(out / "frames")}


def killed_in_driving(out: Path, delay: float, more: list[str]) -> bool:
    """Kill a campaign some seconds [s] after it begins to write frames; whether it lived until then."""
    before = set((out / "frames").glob("*"))
    with subprocess.Popen(campaign(out, *more), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        deadline = time.monotonic() + LONGEST
        while set((out / "frames").glob("*")) == before and process.poll() is None:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        time.sleep(delay)
        alive = process.poll() is None
        process.kill()
    return alive


def killed_after(out: Path, delay: float, more: list[str]) -> bool:
    """Kill a campaign some seconds [s] after its start: while it loads, plans, or makes its folder."""
    with subprocess.Popen(campaign(out, *more), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        time.sleep(delay)
        alive = process.poll() is None
        process.kill()
    return alive


def assert_identified(out: Path) -> None:
    run = open_run(out)
    result = identify(read_run(out), run.plan.vehicle.geometry, known_inertia=run.known_inertia)
    truth = truth_of("prototype")
    for estimate in result.estimates:
        assert abs(estimate.value - truth[estimate.name]) < max(5 * estimate.std, 0.02 * truth[estimate.name])


@pytest.mark.slow
def test_twenty_kills_lose_nothing_that_was_finished(tmp_path: Path) -> None:
    """On a fast machine a campaign may be over before its next kill: the next one is killed then."""
    generator, out = np.random.default_rng(20), tmp_path / "run0"
    kept: dict[str, bytes] = {}
    kills = 0
    while kills < KILLS:
        more = ["--resume"] if (out / "run.json").is_file() else []
        kill = killed_in_driving if kills % 4 else killed_after
        alive = kill(out, float(generator.uniform(0.0, 6.0)), more)
        if (out / "run.json").is_file():
            assert set(open_run(out).plan.steps) == set(FIT_STEPS) - {Step.LATERAL}
        now = finished(out)
        assert kept.items() <= now.items(), "a finished log is gone or was changed"
        kept, kills = now, kills + alive
        if not alive:
            assert_identified(out)
            kept, out = {}, tmp_path / f"run{kills}"
    more = ["--resume"] if (out / "run.json").is_file() else []
    resumed = subprocess.run(campaign(out, *more), capture_output=True, check=False)
    assert resumed.returncode == 0, resumed.stderr.decode()
    assert kept.items() <= finished(out).items()
    assert_identified(out)


@pytest.mark.slow
def test_of_two_campaigns_at_one_new_folder_one_drives_and_the_other_is_told(tmp_path: Path) -> None:
    """Both plan, for neither has written anything yet; then one makes the folder."""
    skips = [word for step in ORDER if step not in (Step.ROTATION, Step.WHEEL_LIFTED) for word in ("--skip", str(step))]
    command = [sys.executable, "-m", "quasiomni", "campaign", "--out", str(tmp_path / "run"), *GIVEN_INERTIA, *skips]
    both = [subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    said = [process.communicate()[1] for process in both]
    codes = [process.returncode for process in both]
    assert sorted(codes) == [0, 2]
    first, second = both[codes.index(0)], said[codes.index(2)]
    assert f"is being driven by process {first.pid} on " in second or "already holds a run" in second
    assert [step for step, _ in finished_steps(tmp_path / "run" / "frames") if step != Step.ALIGNMENT] == ["rotation"]
    assert read_run(tmp_path / "run").of(Step.ROTATION)


FOLDER_MAKER = """
import sys
from pathlib import Path
from hil.campaign.carried import carried_network, carried_vehicle, write_carried
from hil.campaign.lock import driving
from hil.network import DEFAULT_NETWORK
from ident.vehicle.description import find_data_file
from ident.writing import write_whole
folder = Path(sys.argv[1])
print("begin", flush=True)
with driving(folder):
    for number in range(10**9):
        target = folder / str(number)
        write_carried(carried_vehicle(find_data_file("ident.vehicle", "prototype")), target)
        write_carried(carried_network(DEFAULT_NETWORK), target / "network")
        write_whole('{"manifest": "last"}', target / "run.json")
        write_whole(f"{number} " * 10_000, folder / "parameters.toml")
"""


def test_a_folder_whose_making_was_killed_has_whole_files_or_none(tmp_path: Path) -> None:
    """Four kills while folders are made as fast as the disk takes them: a manifest comes only behind all the rest."""
    generator, made = np.random.default_rng(4), 0
    for kill in range(4):
        folder = tmp_path / str(kill)
        command = [sys.executable, "-c", FOLDER_MAKER, str(folder)]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            process.stdout.readline()
            time.sleep(float(generator.uniform(0.05, 0.3)))
            os.kill(process.pid, signal.SIGKILL)
        manifests = list(folder.glob("*/run.json"))
        made += len(manifests)
        for manifest in manifests:
            json.loads(manifest.read_text())
            tomllib.loads((manifest.parent / "vehicle.toml").read_text())
            assert {path.name for path in (manifest.parent / "network").iterdir()} == {
                "network.toml",
                "drive.eds",
                "encoder.eds",
            }
        if (folder / "parameters.toml").is_file():
            words = (folder / "parameters.toml").read_text().split()
            assert len(words) == 10_000
            assert len(set(words)) == 1
    assert made > 4
