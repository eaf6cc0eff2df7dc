"""Accuracy and coverage over many seeds: every run is a whole campaign on the emulator, over CAN.

    python examples/accuracy_study.py prototype compact --seeds 5000 5029 --runs runs/accuracy

Prints a Markdown table for every vehicle, and the test of the intervals over all of them. A seed redraws the excitation
and all noise. Run folders are kept as VEHICLE_SEED in the folder given by --runs: an interrupted study goes on where it
stopped, and a finished one is identified anew in seconds. Seeds that are missing there are driven, unless --jobs is 0.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from hil.bench import emulation
from hil.bench.truth import truth_of
from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.campaign.reading import read_run
from hil.campaign.runner import CampaignRunner
from hil.campaign.study import (
    CHANCE,
    TOGETHER,
    TOLERANCES,
    Accuracy,
    Coverage,
    Outcome,
    accuracy,
    coverage,
    coverages,
    honest,
    outcome_of,
)
from hil.frames.recorder import Recorder
from hil.network import load_network, network_file_of
from ident.campaign.plan import make_plan
from ident.campaign.steps import ORDER, PERIODS
from ident.estimate.identify import identify
from ident.extras import EngineName, default_engine, named_engine
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle


def drive(name: str, seed: int, folder: Path, engine: EngineName) -> None:
    """One campaign on the emulator, into a run folder."""
    vehicle, network_file = load_vehicle(name), network_file_of(name)
    network = load_network(network_file)
    steps = [step for step in ORDER if step is not Step.LATERAL]
    generator = np.random.default_rng(seed)
    plan = make_plan(vehicle, generator, steps=steps, periods=PERIODS, cycle=network.cycle_period)
    run = Run(RunFolder(folder), plan, network, seed, "emulator, in lockstep", name, None, engine=engine)
    create_run(run, find_data_file("ident.vehicle", name))
    with emulation.bench(name, seed, False, network_file, engine=engine) as bench:
        recorder = Recorder(run.folder.frames)
        CampaignRunner(run, bench.bus, bench.clock, recorder, bench.operator, lambda *_: None).drive()
        recorder.close()


def driven(runs: Path, name: str, seed: int, engine: EngineName) -> Path:
    """The run folder of a seed, driven now if there is none."""
    folder = runs / f"{name}_{seed}"
    if not folder.is_dir():
        unfinished = runs / f".{name}_{seed}"
        shutil.rmtree(unfinished, ignore_errors=True)
        drive(name, seed, unfinished, engine)
        unfinished.rename(folder)
    return folder


def outcome(runs: Path, name: str, engine: EngineName, seed: int) -> Outcome:
    """One campaign, identified from its recorded frames."""
    folder = driven(runs, name, seed, engine)
    return outcome_of(seed, identify(read_run(folder), load_vehicle(name).geometry))


def outcomes(runs: Path, name: str, seeds: Sequence[int], jobs: int, engine: EngineName) -> list[Outcome]:
    """All seeds of a vehicle; without jobs, those that are there."""
    if jobs == 0:
        return [outcome(runs, name, engine, seed) for seed in seeds if (runs / f"{name}_{seed}").is_dir()]
    with ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(partial(outcome, runs, name, engine), seeds))


def print_vehicle(name: str, found: Sequence[Outcome], rows: Sequence[Accuracy]) -> None:
    """The table of one vehicle."""
    print(f"\n### {name}, {len(found)} campaigns\n")
    print("| parameter | tolerance % | median abs. error % | bias % | scatter % | half-width % | covered |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        numbers = f"{row.median_error:.3f} | {row.bias:+.3f} | {row.scatter:.3f} | {row.half_width:.3f}"
        print(f"| {row.name} | {TOLERANCES[row.name]} | {numbers} | {row.covered}/{row.runs} |")
    print(f"\nCoverage {coverage(rows):.3f} of {sum(row.runs for row in rows)} parameter-seed pairs.")
    for label, values in (
        ("cond", [outcome.condition for outcome in found]),
        ("lane change, drive force NRMSE", [outcome.drive_nrmse for outcome in found]),
        ("lane change, steering torque NRMSE", [outcome.steering_nrmse for outcome in found]),
    ):
        print(f"{label}: median {np.median(values):.4g}, largest {max(values):.4g}")


def print_coverage(found: Sequence[Coverage]) -> None:
    """The test of the intervals over all vehicles."""
    print("\n### Intervals\n\n| parameter | covered | so few by chance |\n|---|---|---|")
    for one in found:
        print(f"| {one.name} | {one.covered}/{one.runs} | {one.chance:.3f} |")
    lowest, highest = TOGETHER
    print(f"\nAll together {coverage(found):.4f} of {sum(one.runs for one in found)}, must be {lowest} to {highest};")
    print(f"no parameter's chance below {CHANCE}: {'passed' if honest(found) else 'FAILED'}.")


def main() -> None:
    """Run the seeds asked for and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vehicles", nargs="+", help="prototype, compact or both")
    parser.add_argument("--seeds", nargs=2, type=int, default=(5000, 5029), metavar=("FIRST", "LAST"))
    parser.add_argument("--jobs", type=int, default=2, help="campaigns at once; 0 drives none")
    parser.add_argument("--runs", type=Path, default=Path("runs/accuracy"), help="where run folders are kept")
    parser.add_argument(
        "--engine", type=named_engine, default=default_engine(), help="physics of seeds that are missing"
    )
    arguments = parser.parse_args()
    arguments.runs.mkdir(parents=True, exist_ok=True)
    seeds = range(arguments.seeds[0], arguments.seeds[1] + 1)
    tables = []
    for name in arguments.vehicles:
        found = outcomes(arguments.runs, name, seeds, arguments.jobs, arguments.engine)
        tables.append(accuracy(found, truth_of(name)))
        print_vehicle(name, found, tables[-1])
    print_coverage(coverages(tables))


if __name__ == "__main__":
    main()
