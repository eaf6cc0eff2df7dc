"""The steering stops at its limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest


@pytest.mark.parametrize("direction", [+1, -1])
def test_a_side_driven_into_its_stop_stays_within_milliradians_of_it(core: Any, direction: int) -> None:
    instance = core.new()
    torque = direction * core.vehicle.limits.rated_torque
    instance.set(torque_fl=-torque, torque_rl=torque, torque_fr=torque, torque_rr=-torque)
    farthest = np.zeros(2)
    for _ in range(1000):
        instance.step(0.002)
        farthest = np.maximum(farthest, direction * np.array([instance["alpha_l"], instance["alpha_r"]]))
    limit = core.vehicle.geometry.steering_limit
    assert limit < farthest.min()
    assert farthest.max() < limit + 0.02
    assert abs(instance["alpha_l_dot"]) < 1e-4


def test_within_the_stroke_the_stops_are_not_felt(core: Any) -> None:
    limit, prior = core.vehicle.geometry.steering_limit, core.vehicle.prior
    for before in (1e-3, 0.05, 0.5, limit):
        near = core.new(alpha_l=limit - before, alpha_r=before - limit)
        far = near.copy()
        far.set(steering_limit=1e3)
        torque = (near.derivatives() - far.derivatives())[3:5] * [prior["C_l"], prior["C_r"]]
        assert np.abs(torque).max() < 1e-3 * prior["d_cl"]
