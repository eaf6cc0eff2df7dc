"""Rows of the equations as numpy functions."""

from __future__ import annotations

import numpy as np
import pytest

from ident.diagnosis.names import EffectName
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.causes.library import every_unit, term_causes
from ident.diagnosis.vehicle.records.inputs import INPUTS
from ident.diagnosis.vehicle.records.rows import Formulas
from ident.estimate.equations import ROWS
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import COULOMB_EPSILON

NAMES = (EffectName.QUADRATIC_DRAG, EffectName.WHEEL_RADIUS, EffectName.TORQUE_GAIN)


@pytest.mark.parametrize("channel", [Channel.KINEMATIC, Channel.DYNAMIC])
@pytest.mark.parametrize("step", [Step.STEERING_LEFT, Step.STRAIGHT, Step.ROTATION])
def test_columns_are_the_same_whatever_else_the_equations_were_derived_with(
    channel: Channel, step: Step, prototype: VehicleDescription
) -> None:
    units = [unit for cause in term_causes(NAMES) for unit in cause.units]
    inputs = np.random.default_rng(1).normal(size=(20, INPUTS))
    p = prototype.prior.values
    arguments = inputs, prototype.geometry.as_vector(), np.array([COULOMB_EPSILON]), p, p
    alone, of_all = (Formulas(units=known).linearised(channel, ROWS[step], units) for known in (units, every_unit()))
    np.testing.assert_allclose(of_all(*arguments), alone(*arguments), rtol=1e-12, atol=1e-12 * np.abs(p).max())
