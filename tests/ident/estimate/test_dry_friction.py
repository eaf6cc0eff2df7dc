"""Wheels that stick at each reversal: what friction holds there is no part of Θ p = τ, and no parameter leans on it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.estimate.equations import equations_of
from ident.estimate.filters import Processing
from ident.records.record import Segment, Step, make_segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import Parameters, parameter_column

Array = NDArray[np.float64]

DT = 0.002
FINER = 20
"""Steps of the integration in one sample."""
SOUGHT = ("d_vw", "d_cw", "B_w")


def stuck_and_sliding(torque: Array, truth: Parameters) -> tuple[Array, NDArray[np.bool_]]:
    """Angle (N,) of a wheel in the air under torques (N,) held for a sample each, and whether it stood."""
    inertia, viscous, dry, step = truth["B_w"], truth["d_vw"], truth["d_cw"], DT / FINER
    angle = rate = 0.0
    angles, stood = np.empty(len(torque)), np.zeros(len(torque), dtype=bool)
    for sample, pushed in enumerate(torque.tolist()):
        angles[sample] = angle
        for _ in range(FINER):
            free = rate + step * (pushed - viscous * rate) / inertia
            held = step * dry / inertia  # what dry friction takes from a rate in one step, at most
            rate = 0.0 if abs(free) <= held else free - np.sign(free) * held
            angle += step * rate
        stood[sample] = rate == 0.0
    return angles, stood


def torque_of(time: Array, truth: Parameters, share: float) -> Array:
    """A sum of sines, `share` times the dry friction in its largest sine."""
    slow, fast = np.sin(2 * np.pi * 0.25 * time), 0.35 * np.sin(2 * np.pi * 0.75 * time + 1.0)
    return truth["d_cw"] * share * (slow + fast)


@pytest.mark.parametrize("share", [1.4, 1.6, 2.0])
def test_what_friction_holds_at_a_reversal_moves_no_parameter(
    vehicle: VehicleDescription, truth: Parameters, share: float
) -> None:
    time = DT * np.arange(8000)
    held = torque_of(time, truth, share)
    beta, stood = stuck_and_sliding(held, truth)
    assert 0.02 < np.mean(stood) < 0.7, "it sticks for a while at each reversal"
    # A sample of the torque is the mean of what was held before and after it.
    torque = (held + np.concatenate([held[:1], held[:-1]])) / 2 / vehicle.geometry.gear_ratio
    still, once = np.zeros((len(time), 2)), np.zeros(len(time), dtype=int)
    motors, wheels = np.tile(torque[:, None], 4), np.tile(beta[:, None], 4)
    segment = Segment(Step.WHEEL_LIFTED, 0.0, time, motors, wheels, still, once)
    rows = equations_of(make_segment(segment, "stuck"), vehicle.geometry, Processing())[0]
    columns = [parameter_column(name) for name in SOUGHT]
    found = np.linalg.lstsq(rows.regressor[rows.moving][:, columns], rows.torque[rows.moving], rcond=None)[0]
    np.testing.assert_allclose(found, [truth[name] for name in SOUGHT], rtol=1e-3)
