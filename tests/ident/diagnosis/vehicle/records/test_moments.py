"""Forces are looked at while wheels roll: not in moments in which they give way to one another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.experiment.ideal import Drive, ideal_record
from ident.diagnosis.vehicle.records.inputs import SLICES
from ident.diagnosis.vehicle.records.moments import apart_from_moments, giving_way
from ident.diagnosis.vehicle.records.sources import Source, sources_of
from ident.estimate.filters import Processing
from ident.records.record import Record, Step
from ident.vehicle.description import VehicleDescription, load_vehicle

Array = NDArray[np.float64]

RADIUS = load_vehicle("prototype").geometry.wheel_radius


@pytest.fixture(scope="module")
def straight(prototype: VehicleDescription) -> Source:
    record = ideal_record([Drive(Step.STRAIGHT)], prototype)
    return sources_of(record, prototype.geometry, [Step.STRAIGHT], Processing())[0]


def ahead_by(straight: Source, wheel: int, speeds: Array) -> Array:
    """Signals of the drive with a wheel that runs ahead by `speeds` (N,) [m/s]."""
    inputs = straight.inputs.copy()
    inputs[:, SLICES["beta_rate"].start + wheel] += speeds / RADIUS
    return inputs


@pytest.mark.parametrize("wheel", range(4))
def test_a_wheel_gives_way_when_it_runs_ahead_for_a_moment(
    straight: Source, prototype: VehicleDescription, wheel: int
) -> None:
    time = np.arange(len(straight.inputs)) * straight.sample_time
    fastest = time[np.argmax(straight.inputs[:, SLICES["beta_rate"].start])]
    inputs = ahead_by(straight, wheel, 1e-3 * np.exp(-(((time - fastest) / 0.1) ** 2)))
    found = giving_way(inputs, prototype.geometry, straight.sample_time)
    assert found[np.abs(time - fastest) < 0.1].all()
    assert not found[np.abs(time - fastest) > 0.5].any()


@pytest.mark.parametrize("part", [1e-4, 5e-3])
def test_a_wheel_of_another_radius_does_not_give_way(
    straight: Source, prototype: VehicleDescription, part: float
) -> None:
    inputs = ahead_by(straight, 1, part * RADIUS * straight.inputs[:, SLICES["beta_rate"].start + 1])
    assert not giving_way(inputs, prototype.geometry, straight.sample_time).any()


def test_a_wheel_that_creeps_does_not_give_way(straight: Source, prototype: VehicleDescription) -> None:
    rates, torques = (straight.inputs[:, SLICES[name].start + 2] for name in ("beta_rate", "torques"))
    inputs = ahead_by(straight, 2, 5e-3 * RADIUS * np.abs(rates) * torques / np.abs(torques).max())
    assert not giving_way(inputs, prototype.geometry, straight.sample_time).any()


def test_nothing_gives_way_where_nothing_moves(straight: Source, prototype: VehicleDescription) -> None:
    assert not giving_way(np.zeros_like(straight.inputs), prototype.geometry, straight.sample_time).any()


def in_forces(record: Record, prototype: VehicleDescription) -> tuple[Array, Array]:
    """Times (N,) [s] of the dynamic rows of a straight drive, and which of them are used."""
    every = sources_of(record, prototype.geometry, list(Step), Processing())
    found = apart_from_moments(every, prototype.geometry, Processing())
    source = next(source for source in found if source.channel is Channel.DYNAMIC and source.step == Step.STRAIGHT)
    return np.arange(len(source.inputs)) * source.sample_time, source.moving[0]


def slid(record: Record, metres: Array) -> Record:
    """The record with a wheel that has run ahead by `metres` (N,)."""
    (segment,) = record.segments
    angles = segment.wheel_angles.copy()
    angles[:, 0] += metres / RADIUS
    return Record([replace(segment, wheel_angles=angles)])


@pytest.fixture(scope="module")
def rolled(prototype: VehicleDescription) -> Record:
    return ideal_record([Drive(Step.STRAIGHT)], prototype)


def test_forces_are_not_looked_at_while_a_wheel_gives_way(rolled: Record, prototype: VehicleDescription) -> None:
    (segment,) = rolled.segments
    fastest = segment.time[np.argmax(np.gradient(segment.wheel_angles[:, 0]))]
    moment = slid(rolled, 2e-4 * (1 + np.tanh((segment.time - fastest) / 0.1)))
    time, used = in_forces(rolled, prototype)
    _, left = in_forces(moment, prototype)
    since = np.abs(time - (fastest - segment.time[0]))
    assert used[since < 0.1].all()
    assert not left[since < 0.15].any()
    assert np.array_equal(left[since > 0.8], used[since > 0.8])


def test_rolling_is_looked_at_all_the_time(rolled: Record, prototype: VehicleDescription) -> None:
    (segment,) = rolled.segments
    fastest = segment.time[np.argmax(np.gradient(segment.wheel_angles[:, 0]))]
    moment = slid(rolled, 2e-4 * (1 + np.tanh((segment.time - fastest) / 0.1)))
    every = sources_of(moment, prototype.geometry, [Step.STRAIGHT], Processing())
    for before, after in zip(every, apart_from_moments(every, prototype.geometry, Processing()), strict=True):
        if before.channel is Channel.KINEMATIC:
            assert all(np.array_equal(*masks) for masks in zip(before.moving, after.moving, strict=True))


def test_what_wheels_do_most_of_the_time_is_no_moment(rolled: Record, prototype: VehicleDescription) -> None:
    """An eccentric wheel runs ahead once a turn, all the way."""
    (segment,) = rolled.segments
    eccentric = slid(rolled, 5e-4 * np.sin(segment.wheel_angles[:, 0]))
    assert giving_way_somewhere(eccentric, prototype)
    assert np.array_equal(in_forces(eccentric, prototype)[1], in_forces(rolled, prototype)[1])


def test_what_lasts_in_one_drive_belongs_to_the_vehicle_in_all(rolled: Record, prototype: VehicleDescription) -> None:
    (segment,) = rolled.segments
    fastest = segment.time[np.argmax(np.gradient(segment.wheel_angles[:, 0]))]
    moment = slid(rolled, 2e-4 * (1 + np.tanh((segment.time - fastest) / 0.1)))
    turned = ideal_record([Drive(Step.ROTATION)], prototype)
    eccentric = slid(turned, 5e-4 * np.sin(turned.segments[0].wheel_angles[:, 0]))
    for rotation, looked_at in ((turned, False), (eccentric, True)):
        both = Record([*moment.segments, *rotation.segments])
        assert np.array_equal(in_forces(both, prototype)[1], in_forces(rolled, prototype)[1]) == looked_at


def giving_way_somewhere(record: Record, prototype: VehicleDescription) -> bool:
    source = sources_of(record, prototype.geometry, [Step.STRAIGHT], Processing())[0]
    return bool(giving_way(source.inputs, prototype.geometry, source.sample_time).any())
