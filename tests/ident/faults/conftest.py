"""Corruptions of sound records (`hil.exam.corruptions`): sixty or so."""

from __future__ import annotations

import math

import pytest

from hil.exam.corruptions import Corruption, clipped, clock, cut, frozen, late, negated, scaled, swapped, wrapped

DEGREES = 180 / math.pi

ALL = (
    *(
        swapped(f"torque_{one}/torque_{other}")
        for one, other in (("fl", "rl"), ("fl", "fr"), ("rl", "rr"), ("fr", "rr"))
    ),
    *(swapped(f"beta_{one}/beta_{other}") for one, other in (("fl", "rl"), ("fl", "rr"), ("fr", "rr"))),
    swapped("alpha_l/alpha_r"),
    *(negated(channel) for channel in ("torque_fr", "torque", "beta_fr", "beta", "alpha_l", "alpha_r", "alpha")),
    *(scaled("torque", factor) for factor in (1000.0, 0.001, 20.0, 2.0)),
    *(scaled(channel, factor) for channel, factor in (("torque_rl", 2.0), ("torque_rr", 10.0), ("beta_fr", 2.0))),
    *(scaled(channel, DEGREES) for channel in ("beta", "alpha_l", "alpha")),
    *(scaled(channel, factor) for channel, factor in (("alpha_r", 0.5), ("beta", 20.0))),
    *(late(channel, delay) for channel, delay in (("torque", 0.02), ("torque", 0.006), ("torque_fr", 0.05))),
    *(
        late(channel, delay)
        for channel, delay in (("beta", 0.02), ("beta_fl", 0.02), ("alpha_r", 0.05), ("alpha", 0.1))
    ),
    swapped("torque_fl/torque_rl", "steering_left"),
    swapped("beta_fl/beta_rl", "steering_left"),
    negated("torque", "straight"),
    negated("beta_rr", "rotation"),
    negated("alpha_l", "steering_left"),
    scaled("torque", 10.0, "straight"),
    *(frozen(channel, since=0.0) for channel in ("beta_rl", "torque_rl", "alpha_l")),
    frozen("beta_fl", "straight"),
    frozen("torque_fr", "rotation"),
    frozen("alpha_r", "steering_right"),
    clipped("torque_fl", 0.5),
    clipped("torque_rr", 0.6, "straight"),
    clipped("beta_fr", 0.3),
    clipped("alpha_l", 0.6, "steering_left"),
    wrapped("beta_fl", 0.4),
    wrapped("beta", 0.4),
    wrapped("alpha_l", 0.5, "steering_left"),
    wrapped("torque_rl", 0.6, "straight"),
    cut("straight", 40, renumbered=False),
    cut("straight", 40, renumbered=True),
    clock(1e3),
    clock(1e6),
    clock(2.0),
)


@pytest.fixture(scope="session")
def corruptions() -> tuple[Corruption, ...]:
    """Sixty or so, over all names, single channels, pairs and groups, all steps or one."""
    return ALL
