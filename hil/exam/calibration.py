"""Measures the sizes of all effects in noise units, from pairs of runs that differ by the effect alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

from emulator.effects import INJECTORS
from hil.exam.noise_units import Noise, SizeInNoise, noise_of, size_in_noise
from hil.exam.plans import plan_exam
from hil.exam.probes import EVERY, IDLE, SHARES, SMALLER, Probe, all_probes
from hil.exam.sealing import effect_of
from hil.exam.sizes import EffectSize
from hil.exam.workers import run_all
from hil.exam.world import World
from hil.network import load_network
from ident.campaign.plan import Plan
from ident.diagnosis.vehicle.causes.library import DRIFTS
from ident.errors import UserError
from ident.records.record import Record
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import Parameters

PLAN_SEED: Final = 7
"""Of the excitation that sizes are measured under; exams plan their own."""

NOISE_SEED: Final = 11

CLEAR: Final = 0.8
"""Noise units from which on a probe counts: below, the last bits of where the wheels came to rest after an alignment
differ as much between two runs as the effect makes them."""

NEGLIGIBLE: Final = 0.1
"""Noise units that stand for none, for effects that begin at a threshold."""

VISIBLE: Final = 1.0
"""Noise units that an effect must reach at its largest size to be one that these campaigns show."""

AIM: Final = 1.5
"""Noise units near which every effect is measured: the sizes of an exam lie just below."""

APPROACHES: Final = 4
"""Drives at most that look for the size of `AIM`."""

Points = tuple[tuple[float, float], ...]
"""(size, noise units), ascending in noise units."""


@dataclass(frozen=True)
class Bench:
    """What is the same for all probes."""

    plan: Plan
    noise: Noise
    plain: Record
    truth: Parameters
    geometry: Geometry
    world: World


def calibrate(
    world: World,
    jobs: int,
    progress: Callable[[int, int], None],
    names: Container[str] = EVERY,
) -> list[EffectSize]:
    """The table of sizes of a world, or the rows of some effects.

    Args:
        world: vehicle and engine.
        jobs: processes on this machine.
        progress: called with effects measured and in all.
        names: of the effects.
    """
    probes = [
        probe
        for probe in all_probes(load_vehicle(world.vehicle))
        if probe.name in names and world.can_have(probe.name, probe.where)
    ]
    stand_ins = {_key(probe): probe for probe in probes}
    tasks = [(world, probe) for probe in stand_ins.values()]
    measured: dict[tuple[str, str], tuple[str, Points]] = {}
    progress(0, len(tasks))
    for key, channel, points in run_all(measure, tasks, jobs=jobs, scheduler=None):
        measured[key] = channel, points
        progress(len(measured), len(tasks))
    return [_row(probe, *measured[_key(probe)]) for probe in probes]


def measure(world: World, probe: Probe) -> tuple[tuple[str, str], str, Points]:
    """Key of a probe, the channel that shows it and its points there, no points where none does; runs in a worker."""
    bench = _bench(world)
    shares = (*SHARES, IDLE) if INJECTORS[probe.name].threshold else SHARES
    found = _driven(probe, shares, bench) or _driven(probe, SMALLER, bench)
    channel = _shown_in(probe, list(found.values()))
    if channel is None:
        return _key(probe), "torque", ()
    sizes = {size: float(getattr(units, channel)) for size, units in found.items()}
    for _ in range(APPROACHES):
        if any(CLEAR < units < 2 * AIM for units in sizes.values()):
            break
        nearer = _units(probe, size := _nearer(sizes), bench)
        if nearer is None:
            break
        sizes[size] = float(getattr(nearer, channel))
    return _key(probe), channel, _points(probe, sizes)


def _driven(probe: Probe, shares: Sequence[float], bench: Bench) -> dict[float, SizeInNoise]:
    """Noise units by size, of the shares of the largest at which the vehicle can be driven."""
    return {size: units for share in shares if (units := _units(probe, size := _of_share(probe, share), bench))}


def _nearer(sizes: Mapping[float, float]) -> float:
    """A size nearer to `AIM`: in proportion, or between the smallest clear one and the next that does too little."""
    clear = min((size for size, units in sizes.items() if units > CLEAR), key=lambda size: sizes[size])
    idle = [size for size, units in sizes.items() if units <= CLEAR]
    if not idle:
        return clear * AIM / sizes[clear]
    return math.sqrt(clear * min(idle, key=lambda size: abs(math.log(size / clear))))


def _key(probe: Probe) -> tuple[str, str]:
    return str(probe.name), probe.measured_at


@lru_cache(maxsize=1)
def _bench(world: World) -> Bench:
    vehicle, cycle = load_vehicle(world.vehicle), load_network(world.network_file).cycle_period
    plan, truth = plan_exam(vehicle, PLAN_SEED, cycle).fit, world.truth()
    noise = noise_of(world.drive(plan, NOISE_SEED, ()), truth.values, vehicle.geometry)
    once = replace(plan, periods=1)
    return Bench(once, noise, world.drive_quietly(once, ()), truth, vehicle.geometry, world)


def _units(probe: Probe, size: float, bench: Bench) -> SizeInNoise | None:
    """Noise units of a size; None where the vehicle cannot be driven with it."""
    try:
        record = bench.world.drive_quietly(bench.plan, [effect_of(probe.injected(size))])
    except UserError:
        return None
    return size_in_noise(bench.noise, bench.plain, record, bench.truth.values, bench.geometry)


def _of_share(probe: Probe, share: float) -> float:
    """A low friction coefficient is a large slip; all else is large when it is large."""
    return probe.largest / share if INJECTORS[probe.name].threshold else probe.largest * share


def _row(probe: Probe, channel: str, points: Points) -> EffectSize:
    return EffectSize(
        name=str(probe.name),
        where=probe.where,
        parameter=probe.parameter,
        unit=probe.unit,
        channel=channel,
        points=points,
        largest=probe.largest,
        signed=INJECTORS[probe.name].signed,
        known=probe.known,
    )


def _shown_in(probe: Probe, measured: Sequence[SizeInNoise]) -> str | None:
    """The channel that shows the effect best at the first size; None where none shows it, or it stops the vehicle."""
    if not measured:
        return None
    channels = ["drift"] if probe.name in DRIFTS else ["torque"]
    if INJECTORS[probe.name].breaks_rolling:
        channels.append("kinematic")
    best = max(channels, key=lambda name: float(getattr(measured[0], name)))
    return best if any(getattr(units, best) >= VISIBLE for units in measured) else None


def _points(probe: Probe, measured: Mapping[float, float]) -> Points:
    """Clear points in ascending order, and the foot that a threshold rises from."""
    clear = sorted(((size, units) for size, units in measured.items() if units > CLEAR), key=lambda point: point[1])
    idle = [size for size, units in measured.items() if units <= CLEAR]
    if not INJECTORS[probe.name].threshold or not idle:
        return tuple(clear)
    foot = min(idle, key=lambda size: abs(math.log(size / clear[0][0])))
    return ((foot, NEGLIGIBLE), *clear)
