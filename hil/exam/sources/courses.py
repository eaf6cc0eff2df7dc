"""Records of the independent vehicle: random courses, followed by the gains of a careful commissioning engineer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil.exam.sources.independent import CYCLE, SIDE, Plant, Truth
from hil.exam.sources.recording import Flaws, Follow, Signals, run
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]

STEPS = ("steering_left", "steering_right", "straight", "rotation")


@dataclass(frozen=True)
class Course:
    """What a segment is driven along.

    Attributes:
        step: its name.
        position: (N,) of its coordinate [rad or m].
        period: (N,).
    """

    step: str
    position: Array
    period: NDArray[np.int64]


_WIDTH = {"steering_left": 0.9, "steering_right": 0.9, "straight": 1.1, "rotation": 1.0}
"""Largest speed of the coordinate [rad/s or m/s]."""


def course(step: str, generator: np.random.Generator, periods: int, length: float) -> Course:
    """Five harmonics, repeated, after a quarter of a period [s] in which they swell."""
    samples, lead = round(length / CYCLE), round(length / 4 / CYCLE)
    time = np.arange(-lead, periods * samples) * CYCLE
    harmonics = np.arange(1, 6)
    phase, size = generator.uniform(0, 2 * np.pi, 5), generator.uniform(0.5, 1.0, 5) / harmonics
    omega = 2 * np.pi / length * harmonics
    wave = np.sin(omega * time[:, None] + phase) @ size
    rate = (omega * np.cos(omega * time[:, None] + phase)) @ size
    wave *= _WIDTH[step] / np.abs(rate).max()
    swell = np.clip(1 + time / (length / 4), 0, 1)
    period = np.concatenate([np.full(lead, -1), np.repeat(np.arange(periods), samples)])
    return Course(step, wave * swell**3 * (10 - 15 * swell + 6 * swell**2), period)


def drive(
    truth: Truth, vehicle: VehicleDescription, courses: list[Course], generator: np.random.Generator
) -> list[Segment]:
    """Follow the courses side by side; gains are those of a careful commissioning engineer."""
    g = vehicle.geometry
    turned = np.array([float(each.step == "rotation") for each in courses])[:, None]
    plant = Plant(truth, vehicle, turned * g.rotation_angle * np.array([-1.0, 1.0]))
    signals = run(plant, Flaws(), _engineer(truth, vehicle, courses, plant), len(courses[0].position), generator)
    return [_segment(each, index, signals) for index, each in enumerate(courses)]


def _engineer(truth: Truth, vehicle: VehicleDescription, courses: list[Course], plant: Plant) -> Follow:
    """Proportional and differential, on wheels and steering."""
    g, samples = vehicle.geometry, len(courses[0].position)
    turned = np.array([each.step == "rotation" for each in courses])
    held, lever = plant.alpha.copy(), g.wheel_offset / g.wheel_radius
    wanted = np.stack([each.position for each in courses], axis=1)
    rolling = np.array([each.step in ("straight", "rotation") for each in courses])
    sense = np.where(turned[:, None], -SIDE, 1) * rolling[:, None]
    arm = np.where(turned, g.rotation_lever, 1.0) / g.wheel_radius
    steered = np.array([[each.step == "steering_left", each.step == "steering_right"] for each in courses])
    heavy = np.where(turned, truth.parameters["C_ch"], truth.parameters["m_ch"])
    previous = (plant.read()[0], plant.alpha.copy())

    def follow(sample: int, motors: Array, alpha: Array) -> Array:
        nonlocal previous
        rates = (motors - previous[0]) / CYCLE, (alpha - previous[1]) / CYCLE
        previous = (motors, alpha)
        ahead = wanted[min(sample + 1, samples - 1)]
        speed = (ahead - wanted[max(sample - 1, 0)]) / (2 * CYCLE)
        moved, moving = (np.sum(sense * each, axis=1) / 4 / arm for each in (motors, rates[0]))
        pull = rolling * heavy * (60 * (wanted[sample] - moved) + 15 * (speed - moving))
        turn = 400 * (held + steered * wanted[sample][:, None] - alpha) + 20 * (steered * speed[:, None] - rates[1])
        sides = np.stack([-turn[:, 0], turn[:, 0], turn[:, 1], -turn[:, 1]], axis=1) / (2 * lever)
        each = sense * (pull / arm / 4)[:, None] + sides
        return np.asarray(np.clip(each / g.gear_ratio, -3.8, 3.8))

    return follow


def _segment(each: Course, index: int, signals: Signals) -> Segment:
    time = np.arange(len(each.position), dtype=np.float64) * CYCLE
    return Segment(
        each.step,
        CYCLE,
        time,
        signals.torques[:, index],
        signals.motors[:, index],
        signals.steering[:, index],
        each.period,
    )


def two_records(
    truth: Truth,
    vehicle: VehicleDescription,
    generator: np.random.Generator,
    periods: int = 3,
    length: float = 8.0,
) -> tuple[Record, Record]:
    """A record to fit and one to confirm, of other motions and noise, in periods of some length [s]."""
    courses = [course(step, generator, periods, length) for _ in range(2) for step in STEPS]
    segments = drive(truth, vehicle, courses, generator)
    return Record(segments[:4], "fit"), Record(segments[4:], "confirm")
