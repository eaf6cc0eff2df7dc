"""Writes a record of a vehicle that shares no code with model and emulator: a second opinion for what reads records.

    python examples/independent_vehicle.py vehicle.parquet
    python examples/independent_vehicle.py sticky.parquet --effect stribeck@steering_left=4Nm --excitation 2 --seed 2

Its true parameters are those of `hil.exam.sources.independent.Truth`; no wheel turns in the air, so identification
has to be told B_w (--b-w).
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

import numpy as np

from hil.exam.sources.campaigns import drive_campaign
from ident.campaign.plan import make_plan
from ident.effects.text import parse_effect
from ident.errors import UserError
from ident.records.files import write_record
from ident.records.record import FOUR_STEPS, Step
from ident.vehicle.description import load_vehicle

CYCLE: Final = 0.002


def main() -> None:
    """Plan, drive, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("record", type=Path)
    parser.add_argument("--effect", action="append", default=[], metavar="NAME@PLACE=SIZE")
    parser.add_argument("--periods", type=int, default=6, help="repeats of every step, at least 4")
    parser.add_argument("--excitation", type=int, default=1, help="seed of the planned motion")
    parser.add_argument("--seed", type=int, default=1, help="of the noise")
    arguments = parser.parse_args()
    try:
        _write(arguments)
    except UserError as error:
        parser.error(f"{error.what} {error.remedy}")
    print(f"Written: {arguments.record}")


def _write(arguments: argparse.Namespace) -> None:
    plan = make_plan(
        load_vehicle("prototype"),
        np.random.default_rng(arguments.excitation),
        steps=(*FOUR_STEPS, Step.LANE_CHANGE),
        periods=arguments.periods,
        cycle=CYCLE,
    )
    record = drive_campaign(plan, arguments.seed, [parse_effect(text) for text in arguments.effect])
    write_record(record, arguments.record)


if __name__ == "__main__":
    main()
