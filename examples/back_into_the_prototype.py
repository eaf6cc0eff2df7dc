"""What a diagnosis is worth to a simulator: the emulated vehicle before and after, against a record not fitted to.

    python examples/back_into_the_prototype.py --runs runs/back --engine pybullet

For every effect a vehicle that has it drives two campaigns of different excitation, the second to confirm the first.
The first alone gives the numbers: identified, they are the simulator before, with the effects that both show, that
after. Then the torques of the second go through both, on the engine that drove it and on the other one. Prints a
Markdown table. Everything is kept in the folder given by --runs: an interrupted study goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from hil.bench import emulation
from hil.campaign.asked import DiagnosisOrder
from hil.campaign.creating import create_run
from hil.campaign.diagnosing import diagnose_records, write_answer
from hil.campaign.folder import Run, RunFolder
from hil.campaign.results import identify_run, write_result
from hil.campaign.runner import CampaignRunner
from hil.cosimulation.simulator_gap import SimulatorOrder, judge_simulator, write_simulator_gap
from hil.frames.recorder import Recorder
from hil.network import load_network, network_file_of
from ident.campaign.plan import make_plan
from ident.campaign.steps import ORDER, PERIODS
from ident.diagnosis.vehicle.closing import extended_model
from ident.effects.text import parse_effect
from ident.extras import EngineName, default_engine, named_engine
from ident.parameters_file import write_model
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle

EFFECTS: Final = {
    "stribeck@steering_left=4Nm": 7001,
    "asymmetric_coulomb@steering_right=3Nm": 7011,
    "quadratic_drag@chassis=40N s^2/m^2": 7021,
    "torque_bias@drive_fl=0.05Nm": 7031,
    "slope@chassis=0.3deg": 7041,
    "asymmetric_viscous@steering_left=1Nm s/rad": 7061,
}
"""At sizes that one meets, with the seed of the first campaign; the second has the next one."""

ROLES: Final = ("fit", "confirm")


@dataclass(frozen=True)
class Case:
    """A vehicle with an effect.

    Attributes:
        folder: of its campaigns and results.
        vehicle: prototype by name.
        effect: as on the command line.
        engine: that drives its campaigns.
        seed: of the first campaign; the second has the next one.
    """

    folder: Path
    vehicle: str
    effect: str
    engine: EngineName
    seed: int


def drive(case: Case, seed: int, folder: Path) -> None:
    """One campaign on the emulator, into a run folder."""
    vehicle, network_file = load_vehicle(case.vehicle), network_file_of(case.vehicle)
    network = load_network(network_file)
    steps = [step for step in ORDER if step is not Step.LATERAL]
    generator = np.random.default_rng(seed)
    plan = make_plan(vehicle, generator, steps=steps, periods=PERIODS, cycle=network.cycle_period)
    where = "emulator, in lockstep"
    run = Run(RunFolder(folder), plan, network, seed, where, case.vehicle, None, engine=case.engine)
    create_run(run, find_data_file("ident.vehicle", case.vehicle))
    effects = (parse_effect(case.effect),)
    with emulation.bench(case.vehicle, seed, False, network_file, effects, engine=case.engine) as bench:
        recorder = Recorder(run.folder.frames)
        CampaignRunner(run, bench.bus, bench.clock, recorder, bench.operator, lambda *_: None).drive()
        recorder.close()


def driven(case: Case, role: str) -> Path:
    """The run folder of a campaign, driven now if there is none."""
    folder = case.folder / role
    if not folder.is_dir():
        unfinished = case.folder / f".{role}"
        shutil.rmtree(unfinished, ignore_errors=True)
        drive(case, case.seed + ROLES.index(role), unfinished)
        unfinished.rename(folder)
    return folder


def models(case: Case) -> tuple[Path, Path]:
    """Files of the plain model and of that with what was diagnosed; the second is missing where nothing was named."""
    fit, confirm = driven(case, "fit"), driven(case, "confirm")
    plain, extended, found = fit / "parameters.toml", case.folder / "extended.toml", case.folder / "diagnosis.json"
    if not plain.is_file():
        write_result(identify_run(fit, fit).content, fit)
    if not found.is_file():
        order = DiagnosisOrder((fit,), (confirm,), None, None, False, 1, found, None)
        answer = diagnose_records(order)
        if answer.findings is not None and answer.model is not None:
            held_out = extended_model(answer.findings, load_vehicle(case.vehicle).prior, held_out=True)
            write_model(held_out, extended, {"run": "diagnosis", "records": "fit"}, geometry=answer.geometry)
        write_answer(order, answer)
    return plain, extended


def judged(case: Case, engine: EngineName) -> dict[str, Any] | None:
    """Numbers of the gap on an engine; None where the diagnosis named nothing, so that nothing can be put back."""
    before, after = models(case)
    if not after.is_file():
        return None
    result = case.folder / f"gap_{engine}.json"
    if not result.is_file():
        record = driven(case, "confirm")
        report = result.with_suffix(".html")
        order = SimulatorOrder(record, after, before, None, None, engine, result, report, force=True)
        write_simulator_gap(order, judge_simulator(order))
    answer: dict[str, Any] = json.loads(result.read_text())
    return answer


def row(case: Case, engine: EngineName) -> str:
    """A line of the table."""
    answer = judged(case, engine)
    if answer is None:
        verdict = json.loads((case.folder / "diagnosis.json").read_text())["verdict"]
        return f"| `{case.effect}` | {verdict} | {case.engine} | {engine} | | | | | |"
    total = answer["total"]
    largest = max(answer["steps"], key=lambda step: step["share"] or 0.0)
    free = [step for step in answer["steps"] if step["floor"] is None]
    lane = ", ".join(f"{step['coordinate']} {max(step['closed'], 0.0):.0%}" for step in free)
    named = ", ".join(answer["effects"])
    where = f"{largest['step']}, {largest['coordinate']}"
    numbers = f"{total['before']:.2f} | {total['after']:.2f} | {total['closed']:.1%}"
    return f"| `{case.effect}` | {named} | {case.engine} | {engine} | {where} | {numbers} | {lane} |"


def main() -> None:
    """Drive, diagnose, simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vehicle", default="prototype")
    parser.add_argument("--engine", type=named_engine, default=default_engine(), help="that drives the records")
    parser.add_argument("--effect", action="append", help="in place of these; repeat for more")
    parser.add_argument("--seed", type=int, help="of the first campaign of the first effect, and 10 more of each next")
    parser.add_argument("--runs", type=Path, default=Path("runs/back"), help="where everything is kept")
    arguments = parser.parse_args()
    print(
        "| effect | diagnosed | driven on | simulated on | mostly in | before | after | closed | lane change, least |"
    )
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    for number, effect in enumerate(arguments.effect or EFFECTS):
        seed = EFFECTS.get(effect, 7101 + 10 * number) if arguments.seed is None else arguments.seed + 10 * number
        name = f"{arguments.vehicle}_{arguments.engine}_{effect.partition('=')[0].replace('@', '_')}_{seed}"
        case = Case(arguments.runs / name, arguments.vehicle, effect, arguments.engine, seed)
        for engine in sorted(EngineName, key=lambda one: one is not arguments.engine):
            print(row(case, engine), flush=True)


if __name__ == "__main__":
    main()
