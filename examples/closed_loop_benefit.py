"""The lane change with and without the effect in the feed-forward, on an emulated vehicle that has it.

    python examples/closed_loop_benefit.py "asymmetric_coulomb@steering_left=6Nm" --seeds 3
    python examples/closed_loop_benefit.py "asymmetric_coulomb@steering_left=6Nm" --diagnose

Without `--diagnose` the model's parameters are the emulator's truth and the effect's size is exact, so that what is
compared is the feed-forward alone. With it, nothing is known: two campaigns are driven and diagnosed, the models
compared are refitted from them without and with what was found, and a lane change that took no part says how far the
gap shrinks.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from hil.bench.closed_loop import Tracking, track_lane_change
from hil.bench.truth import truth_of
from hil.exam.worlds import world_of
from hil.network import load_network, network_file_of
from ident.campaign.plan import Plan, make_plan
from ident.diagnosis.vehicle.closing import channel_gaps, extended_model, plain_model
from ident.diagnosis.vehicle.diagnose import diagnose_vehicle
from ident.effects import Effect
from ident.effects.extended import ExtendedModel
from ident.effects.text import parse_effect
from ident.extras import EngineName, named_engine
from ident.records.record import FOUR_STEPS, Record, Step
from ident.vehicle.description import VehicleDescription, load_vehicle

FIRST_SEED = 1001
"""Of the campaigns' noise; the lane changes that are tracked have 1, 2, ..."""


def main() -> None:
    """Drive and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("effects", nargs="+", type=parse_effect)
    parser.add_argument("--vehicle", default="prototype")
    parser.add_argument("--engine", type=named_engine, help="physics engine; default: PyBullet where it is installed")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--diagnose", action="store_true", help="find the effects instead of knowing them")
    arguments = parser.parse_args()
    vehicle, effects = load_vehicle(arguments.vehicle), tuple(arguments.effects)
    if arguments.diagnose:
        models = _found(vehicle, arguments.vehicle, arguments.engine, effects)
    else:
        truth = truth_of(arguments.vehicle)
        models = ExtendedModel(truth), ExtendedModel(truth, effects)
    plan = _plan(vehicle, arguments.vehicle, [Step.LANE_CHANGE], 1)
    network = network_file_of(arguments.vehicle)
    for name, model in zip(("plain", "with effect"), models, strict=True):
        runs = [
            track_lane_change(
                plan,
                model,
                prototype=arguments.vehicle,
                seed=seed,
                network=network,
                effects=effects,
                engine=arguments.engine,
            )
            for seed in range(1, arguments.seeds + 1)
        ]
        print(f"{name:<12} {_mean(runs)}")


def _plan(vehicle: VehicleDescription, name: str, steps: Sequence[Step], seed: int) -> Plan:
    cycle = load_network(network_file_of(name)).cycle_period
    return make_plan(vehicle, np.random.default_rng(seed), steps=steps, periods=4, cycle=cycle)


def _found(
    vehicle: VehicleDescription, name: str, engine: EngineName | None, effects: tuple[Effect, ...]
) -> tuple[ExtendedModel, ExtendedModel]:
    """Models refitted without and with what a diagnosis finds; prints it, and the gaps of the lane change."""
    campaigns = [
        world_of(name, engine).drive(_plan(vehicle, name, steps, seed), FIRST_SEED + seed, effects)
        for seed, steps in ((2, FOUR_STEPS), (3, (*FOUR_STEPS, Step.LANE_CHANGE)))
    ]
    fit, (confirm, unseen) = campaigns[0], _split(campaigns[1])
    findings = diagnose_vehicle([fit], [confirm], vehicle).findings
    models = plain_model(findings, vehicle.prior), extended_model(findings, vehicle.prior)
    for effect in models[1].effects:
        print("found", effect, *(f"{key} {value.value:.4g}" for key, value in effect.parameters.items()))
    for channel, gap in channel_gaps([unseen], vehicle, *models, repeated=[confirm]).items():
        print(f"lane change, {channel}: {gap.before:.2f} times the noise, {gap.after:.2f} with what was found")
    return models


def _split(record: Record) -> tuple[Record, Record]:
    """The four steps, and the lane change."""
    parts = (
        [segment for segment in record.segments if (segment.step == Step.LANE_CHANGE) is changing]
        for changing in (False, True)
    )
    return Record(next(parts), record.source), Record(next(parts), "lane change")


def _mean(runs: list[Tracking]) -> str:
    steering = 1e3 * np.mean([run.steering for run in runs])
    travel = 1e3 * np.mean([run.travel for run in runs])
    return f"steering error {steering:.2f} mrad rms, travel error {travel:.2f} mm rms"


if __name__ == "__main__":
    main()
