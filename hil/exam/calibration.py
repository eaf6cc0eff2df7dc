"""Measures the sizes of all effects in noise units, from pairs of runs that differ by the effect alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from hil.exam.driving import drive
from hil.exam.noise_units import Noise, SizeInNoise, noise_of, size_in_noise
from hil.exam.plans import plan_exam
from hil.exam.probes import CURVED, DRIFTS, KINEMATIC, SHARE, SIGNED, Probe, all_probes
from hil.exam.quiet import drive_quietly
from hil.exam.sealing import effect_of
from hil.exam.sizes import EffectSize
from hil.truth import truth_of
from ident.campaign.plan import Plan
from ident.errors import UserError
from ident.records.record import Record
from ident.vehicle.description import load_vehicle
from ident.vehicle.effects import EffectName
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


@dataclass(frozen=True)
class Bench:
    """What is the same for all probes."""

    plan: Plan
    noise: Noise
    plain: Record
    truth: Parameters
    geometry: Geometry
    prototype: str


def calibrate(prototype: str, cycle: float, progress: Callable[[int, int], None]) -> list[EffectSize]:
    """The table of sizes of a prototype.

    Args:
        prototype: of the emulator, by name.
        cycle: T_s [s].
        progress: called with probes measured and in all.
    """
    bench = _bench(prototype, cycle)
    probes = list(all_probes())
    measured: dict[tuple[str, str], tuple[tuple[float, SizeInNoise], ...]] = {}
    rows = []
    for done, probe in enumerate(probes):
        progress(done, len(probes))
        key = (probe.name, probe.measured_at)
        if key not in measured:
            measured[key] = tuple(_measure(probe, bench))
        rows.append(_row(probe, measured[key]))
    progress(len(probes), len(probes))
    return rows


def _bench(prototype: str, cycle: float) -> Bench:
    vehicle = load_vehicle(prototype)
    plan, truth = plan_exam(vehicle, PLAN_SEED, cycle).fit, truth_of(prototype)
    noise = noise_of(drive(plan, prototype, NOISE_SEED, ()), truth.values, vehicle.geometry)
    once = replace(plan, periods=1)
    return Bench(once, noise, drive_quietly(once, prototype, ()), truth, vehicle.geometry, prototype)


def _measure(probe: Probe, bench: Bench) -> list[tuple[float, SizeInNoise]]:
    """Size of the probe at some shares of its largest; those that the vehicle cannot drive with are left out."""
    found = []
    for share in CURVED.get(EffectName(probe.name), (SHARE,)) if probe.known else (SHARE,):
        size = _of_share(probe, share)
        try:
            record = drive_quietly(bench.plan, bench.prototype, [effect_of(probe.injected(size))])
        except UserError:
            break
        found.append((size, size_in_noise(bench.noise, bench.plain, record, bench.truth.values, bench.geometry)))
    return found


def _of_share(probe: Probe, share: float) -> float:
    """A low friction coefficient is a large slip; all else is large when it is large."""
    return probe.largest / share if probe.name == "slip" else probe.largest * share


def _row(probe: Probe, measured: Sequence[tuple[float, SizeInNoise]]) -> EffectSize:
    channel, points = _seen_in(probe, measured)
    return EffectSize(
        name=str(probe.name),
        where=probe.where,
        parameter=probe.parameter,
        unit=probe.unit,
        channel=channel,
        points=points,
        largest=probe.largest,
        signed=probe.name in SIGNED,
        known=probe.known,
    )


def _seen_in(
    probe: Probe, measured: Sequence[tuple[float, SizeInNoise]]
) -> tuple[str, tuple[tuple[float, float], ...]]:
    """The channel that shows the effect, and its points there; no points where none does."""
    channels = ["drift"] if probe.name in DRIFTS else ["torque"]
    if probe.name in KINEMATIC:
        channels.append("kinematic")
    for channel in channels:
        points = [(size, float(getattr(units, channel))) for size, units in measured]
        if any(units >= VISIBLE for _, units in points):
            clear = [point for point in points if point[1] > CLEAR]
            return channel, _ascending([*_foot(points), *clear] if probe.name in CURVED else clear)
    return "torque", ()


def _foot(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The last size that does nothing yet, from which a threshold rises."""
    idle = [(size, NEGLIGIBLE) for size, units in points if units < NEGLIGIBLE]
    return idle[-1:]


def _ascending(points: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Points whose noise units grow from one to the next."""
    kept: list[tuple[float, float]] = []
    for point in points:
        if not kept or point[1] > kept[-1][1]:
            kept.append(point)
    return tuple(kept)
