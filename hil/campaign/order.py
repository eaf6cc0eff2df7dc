"""A campaign as it is asked for: planned, and refused where it goes on otherwise than it was planned."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Final

import numpy as np

from hil.campaign.creating import refuse_used
from hil.campaign.folder import (
    Run,
    RunFolder,
    carries_network,
    carries_simulator,
    carries_vehicle,
)
from hil.frames.recorder import LogFormat
from hil.network import network_file_of
from hil.network.described import load_described
from ident.campaign.plan import make_plan
from ident.campaign.steps import DIAGNOSTIC
from ident.errors import CampaignError
from ident.estimate.result import KnownInertia
from ident.extras import EngineName
from ident.vehicle.description import find_data_file


@dataclass(frozen=True)
class Order:
    """A campaign as it is asked for.

    Attributes:
        out: run folder.
        vehicle: shipped vehicle file by name, or a path.
        network: network file, None for the vehicle's own.
        steps, periods, seed: what to drive.
        known_inertia: B_w where it is given.
        log_format: of the logs.
        bus: what it is driven on, for people.
        prototype: emulated prototype, empty on a real vehicle.
        payload: mass of the load of the loaded steps [kg].
        resume: go on with the run that is there.
        demo: what an earlier demo has left in the folder goes.
        engine: physics engine of the emulated prototype, None on a real vehicle.
        simulator: `parameters.toml` that the emulated vehicle is made from, None for the prototype as it is.
    """

    out: Path
    vehicle: str
    network: Path | None
    steps: tuple[str, ...]
    periods: int
    seed: int
    known_inertia: KnownInertia | None
    log_format: LogFormat
    bus: str
    prototype: str
    payload: float = 0.0
    resume: bool = False
    demo: bool = False
    engine: EngineName | None = None
    simulator: Path | None = None


Planned = Callable[[int, int], None]
"""Called with the number of excitations optimised, and of all."""


def _unheard(_done: int, _total: int) -> None:
    """Nobody waits."""


def plan_run(order: Order, planned: Planned = _unheard) -> Run:
    """Optimise the excitation; nothing is written yet.

    Raises:
        UserError: a file is wrong, the folder is in use, or the floor is too small.
    """
    described = load_described(order.vehicle, order.network or network_file_of(order.vehicle))
    vehicle, network = described.vehicle, described.network
    refuse_used(
        RunFolder(order.out),
        find_data_file("ident.vehicle", order.vehicle),
        network.path,
        simulator=order.simulator,
        by_demo=order.demo,
    )
    total = sum(step in DIAGNOSTIC and DIAGNOSTIC[step].optimised for step in order.steps)
    done = count(1)
    planned(0, total)
    plan = make_plan(
        vehicle,
        np.random.default_rng(order.seed),
        steps=order.steps,
        periods=order.periods,
        cycle=network.cycle_period,
        progress=lambda _: planned(next(done), total),
    )
    return Run(
        RunFolder(order.out),
        plan,
        network,
        order.seed,
        order.bus,
        order.prototype,
        order.known_inertia,
        order.payload,
        order.demo,
        order.engine,
        order.simulator,
    )


_OPTIONS: Final = {"simulator": "--from"}
"""Options that are not called what they are in Python, where `from` is a word of the language."""


def refuse_changed(run: Run, order: Order, given: Collection[str]) -> None:
    """Refuse options of a resumed campaign that differ from what was planned.

    Args:
        run: as it was planned.
        order: as it is asked for now.
        given: names of the options that were given.

    Raises:
        CampaignError: an option that was given differs; named.
    """
    changed: Mapping[str, Callable[[], bool]] = {
        "vehicle": lambda: not carries_vehicle(run.folder, find_data_file("ident.vehicle", order.vehicle)),
        "network": lambda: not carries_network(run.folder, order.network or network_file_of(order.vehicle)),
        "skip": lambda: order.steps != run.plan.steps,
        "lateral": lambda: order.steps != run.plan.steps,
        "diagnostic": lambda: order.steps != run.plan.steps,
        "payload": lambda: order.payload != run.payload,
        "b_w": lambda: order.known_inertia != run.known_inertia,
        "b_w_std": lambda: order.known_inertia != run.known_inertia,
        "periods": lambda: order.periods != run.plan.periods,
        "seed": lambda: order.seed != run.seed,
        "engine": lambda: order.engine != run.engine,
        "simulator": lambda: order.simulator is None or not _same_simulator(run, order.simulator),
    }
    different = [name for name, differs in changed.items() if name in given and differs()]
    if different:
        options = ", ".join(_OPTIONS.get(name, f"--{name.replace('_', '-')}") for name in different)
        raise CampaignError(
            f"{run.folder.path} was planned with another {options}.",
            "A run goes on as it was planned: leave that out, or start another run (--out).",
        )


def _same_simulator(run: Run, path: Path) -> bool:
    return run.simulator is not None and carries_simulator(run.folder, path)
