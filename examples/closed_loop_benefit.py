"""The lane change with and without the effect in the feed-forward, on an emulated vehicle that has it.

    python examples/closed_loop_benefit.py "asymmetric_coulomb@steering_left=6Nm" --seeds 3

The model's parameters are the emulator's truth and the effect's size is exact, so that what is compared is the
feed-forward alone.
"""

from __future__ import annotations

import argparse

import numpy as np

from hil.campaign.folder import network_file_of
from hil.closed_loop import Tracking, track_lane_change
from hil.network import load_network
from hil.truth import truth_of
from ident.campaign.plan import make_plan
from ident.records.record import Step
from ident.vehicle.description import load_vehicle
from ident.vehicle.effect_text import parse_effect
from ident.vehicle.extended import ExtendedModel


def main() -> None:
    """Drive and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("effects", nargs="+", type=parse_effect)
    parser.add_argument("--vehicle", default="prototype")
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    network = network_file_of(arguments.vehicle)
    vehicle, truth = load_vehicle(arguments.vehicle), truth_of(arguments.vehicle)
    cycle = load_network(network).cycle_period
    plan = make_plan(vehicle, np.random.default_rng(1), steps=[Step.LANE_CHANGE], periods=4, cycle=cycle)
    effects = tuple(arguments.effects)
    for name, model in (("plain", ExtendedModel(truth)), ("with effect", ExtendedModel(truth, effects))):
        runs = [
            track_lane_change(plan, model, prototype=arguments.vehicle, seed=seed, network=network, effects=effects)
            for seed in range(1, arguments.seeds + 1)
        ]
        print(f"{name:<12} {_mean(runs)}")


def _mean(runs: list[Tracking]) -> str:
    steering = 1e3 * np.mean([run.steering for run in runs])
    travel = 1e3 * np.mean([run.travel for run in runs])
    return f"steering error {steering:.2f} mrad rms, travel error {travel:.2f} mm rms"


if __name__ == "__main__":
    main()
