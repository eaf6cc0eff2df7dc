"""The drive inside an FMU, integrated by one solver, against another one of another kind."""

from __future__ import annotations

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from fmu.model.equations import equations
from fmu.reference import INTERVAL, reference_drive
from fmu.table import variable_table
from fmu.variables import Block, Inputs
from ident.effects import make_effect
from ident.vehicle.description import load_vehicle

DECIMALS = 6


def test_radau_collocation_comes_to_the_same_motion() -> None:
    """Implicit Runge-Kutta of fifth order (Hairer and Wanner) where the reference is a multistep method."""
    vehicle = load_vehicle()
    effects = [
        make_effect("stribeck", "wheels", {"amplitude": 1.0, "velocity": 0.3}),
        make_effect("slope", "chassis", {"angle": 0.004}),
    ]
    table = variable_table(vehicle, vehicle.prior, effects, Inputs.TORQUE)
    reference = reference_drive(table, effects, Inputs.TORQUE)
    model = equations(table, effects, Inputs.TORQUE)
    numbers = ca.DM([row.start or 0.0 for row in table.block(Block.PARAMETER)])
    rates = ca.substitute(model.xd, model.p, numbers)
    derivative = ca.Function("xd", [model.x, model.u], [ca.densify(rates)])
    jacobian = ca.Function("J", [model.x, model.u], [ca.densify(ca.jacobian(rates, model.x))])
    inputs = np.array(list(reference.inputs.values()))
    state = np.array([row.start or 0.0 for row in table.block(Block.STATE)])
    for start, stop in zip(reference.corners[::2], reference.corners[1::2], strict=True):
        held = inputs[:, np.searchsorted(reference.corners, start, side="right") - 1]
        found = solve_ivp(
            lambda _, x, u=held: np.asarray(derivative(x, u))[:, 0],
            (0.0, stop - start),
            state,
            method="Radau",
            jac=lambda _, x, u=held: np.asarray(jacobian(x, u)),
            rtol=1e-8,
            atol=1e-10,
        )
        state = found.y[:, -1]
        for row in table.block(Block.STATE):
            if row.name in reference.outputs:
                expected = reference.outputs[row.name][round(stop / INTERVAL)]
                np.testing.assert_allclose(state[row.index], expected, rtol=0, atol=10**-DECIMALS, err_msg=row.name)
