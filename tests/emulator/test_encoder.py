"""Shaft encoders count in finite increments, from a preset, in their own direction, into 32 bits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emulator.encoder import wrap_signed, wrap_unsigned
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle


@given(st.integers(-(2**40), 2**40))
def test_a_wrapped_count_is_the_same_register_content(count: int) -> None:
    assert -(2**31) <= wrap_signed(count) < 2**31
    assert 0 <= wrap_unsigned(count) < 2**32
    assert (wrap_signed(count) - count) % 2**32 == 0
    assert (wrap_unsigned(count) - wrap_signed(count)) % 2**32 == 0


@given(st.integers(-(2**31), 2**31 - 1), st.integers(-(2**30), 2**30))
def test_differences_of_wrapped_counts_survive_the_wrap(start: int, move: int) -> None:
    assert wrap_signed(wrap_signed(start + move) - wrap_signed(start)) == move


@pytest.mark.parametrize("name", ["prototype", "compact"])
@pytest.mark.parametrize("angles", [(0.0, 0.0), (0.3, -0.7), (-1.5, 1.5)])
def test_steering_encoders_read_the_front_wheels_angle(name: str, angles: tuple[float, float]) -> None:
    prototype = load_prototype(name)
    left, right = angles
    with EmulatedVehicle(prototype, seed=0, noise_scale=0.0) as vehicle:
        vehicle.engine.place(on_stand=True, angles=[left, -left, right, -right, 0, 0, 0, 0])
        for encoder, angle, direction in zip(vehicle.encoders, angles, prototype.encoder.directions, strict=True):
            counts = direction * angle / math.tau * 2**17
            assert encoder.counts_per_revolution == 2**17
            assert abs(encoder.position() - 65536 - counts) <= 0.5


@pytest.mark.parametrize("turns", [0.25, -3.7, 150.0, -150.0])
def test_motor_encoders_count_motor_turns_and_wrap_as_signed_32_bit(turns: float) -> None:
    prototype = load_prototype()
    with EmulatedVehicle(prototype, seed=0, noise_scale=0.0) as vehicle:
        vehicle.engine.place(on_stand=True, angles=[0.0] * 4 + [turns * math.tau] * 4)
        for drive, direction in zip(vehicle.drives, prototype.drive.directions, strict=True):
            counts = direction * turns * prototype.geometry.gear_ratio * 2**20
            assert abs(wrap_signed(drive.position() - round(counts))) <= 1
            assert -(2**31) <= drive.position() < 2**31


def test_dither_moves_a_reading_by_about_half_an_increment() -> None:
    with EmulatedVehicle(load_prototype(), seed=5) as vehicle:
        vehicle.lift()
        readings = []
        for _ in range(2000):
            vehicle.advance(1e-3)
            readings.append([encoder.position() for encoder in vehicle.encoders])
    spread = [max(side) - min(side) for side in zip(*readings, strict=True)]
    assert all(2 <= width <= 6 for width in spread)
