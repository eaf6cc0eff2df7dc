"""Accuracy and coverage over many seeds: every run is a whole campaign on the emulator, over CAN.

    python examples/accuracy_study.py prototype --seeds 1000 1019 --jobs 2

Prints one Markdown table. A seed redraws the excitation and all noise. Finished seeds are kept in the folder given
by --out, so that an interrupted study goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from hil import emulation
from hil.campaign.folder import Run, RunFolder, create_run, network_file_of
from hil.campaign.reading import read_run
from hil.campaign.runner import CampaignRunner
from hil.campaign.study import TOLERANCES, Outcome, accuracy, coverage, outcome_of
from hil.network import load_network
from hil.recorder import Recorder
from hil.truth import truth_of
from ident.campaign.plan import make_plan
from ident.campaign.steps import ORDER, PERIODS
from ident.estimate.identify import identify
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle


def run_campaign(name: str, seed: int, folder: Path) -> Outcome:
    """One campaign on the emulator, identified from its recorded frames."""
    vehicle, network_file = load_vehicle(name), network_file_of(name)
    network = load_network(network_file)
    steps = [step for step in ORDER if step is not Step.LATERAL]
    generator = np.random.default_rng(seed)
    plan = make_plan(vehicle, generator, steps=steps, periods=PERIODS, cycle=network.cycle_period)
    run = Run(RunFolder(folder), plan, network, seed, "emulator, in lockstep", name, None)
    create_run(run, find_data_file("ident.vehicle", name))
    with emulation.bench(name, seed, False, network_file) as bench:
        recorder = Recorder(run.folder.frames)
        CampaignRunner(run, bench.bus, bench.clock, recorder, bench.operator, lambda *_: None).drive()
        recorder.close()
    return outcome_of(seed, identify(read_run(folder), vehicle.geometry))


def kept_outcome(name: str, out: Path, seed: int) -> Outcome:
    """The outcome of a seed, from its file where there is one."""
    path = out / f"{name}_{seed}.json"
    if not path.is_file():
        with tempfile.TemporaryDirectory() as folder:
            outcome = run_campaign(name, seed, Path(folder) / "run")
        entry = {
            **vars(outcome),
            "values": outcome.values.tolist(),
            "intervals": outcome.intervals.tolist(),
        }
        path.write_text(json.dumps(entry), encoding="utf-8")
    entry = json.loads(path.read_text(encoding="utf-8"))
    return Outcome(**{**entry, "values": np.array(entry["values"]), "intervals": np.array(entry["intervals"])})


def main() -> None:
    """Run the seeds asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("vehicle", help="prototype or compact")
    parser.add_argument("--seeds", nargs=2, type=int, default=(1000, 1019), metavar=("FIRST", "LAST"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/accuracy"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    seeds = range(arguments.seeds[0], arguments.seeds[1] + 1)
    with ProcessPoolExecutor(arguments.jobs) as pool:
        outcomes = list(pool.map(partial(kept_outcome, arguments.vehicle, arguments.out), seeds))
    rows = accuracy(outcomes, truth_of(arguments.vehicle))
    print("| parameter | tolerance % | median abs. error % | bias % | scatter % | half-width % | covered |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        numbers = f"{row.median_error:.3f} | {row.bias:+.3f} | {row.scatter:.3f} | {row.half_width:.3f}"
        print(f"| {row.name} | {TOLERANCES[row.name]} | {numbers} | {row.covered}/{row.runs} |")
    print(f"\nCoverage {coverage(rows):.3f} of {sum(row.runs for row in rows)} parameter-seed pairs.")
    for label, values in (
        ("cond", [outcome.condition for outcome in outcomes]),
        ("lane change, drive force NRMSE", [outcome.drive_nrmse for outcome in outcomes]),
        ("lane change, steering torque NRMSE", [outcome.steering_nrmse for outcome in outcomes]),
    ):
        print(f"{label}: median {np.median(values):.4g}, largest {max(values):.4g}")


if __name__ == "__main__":
    main()
