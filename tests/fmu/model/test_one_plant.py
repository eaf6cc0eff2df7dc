"""The C code of the FMU, the rows of the estimate and the simulation are one plant, hidden states included."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from fmu.table import variable_table
from fmu.variables import Block, Inputs
from ident.diagnosis.problem import Channel
from ident.diagnosis.vehicle.records.inputs import INPUTS, SLICES
from ident.diagnosis.vehicle.records.rows import Formulas
from ident.effects import Effect, EffectTerm, make_effect, terms_of
from ident.estimate.equations import ROWS
from ident.plant import creeping, dynamics, kinematics, symbolic
from ident.plant.balance import Resistance
from ident.plant.modes import Mode
from ident.plant.rolling import Point, RollingModel
from ident.plant.symbols import Symbols
from ident.plant.terms import Masses, State, Term, changed_parameters, shaft_torques
from ident.plant.transmissions import SpringNumbers, at_motors, coupling, gear
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.parameters import COULOMB_EPSILON, PARAMETER_NAMES

Array = NDArray[np.float64]

EFFECTS = (
    make_effect("elasticity", "drive_fl", {"compliance": 2e-3}),
    make_effect("backlash", "drive_rr", {"gap": 0.01}),
    make_effect("elasticity", "steering_left", {"compliance": 1e-3}),
    make_effect("friction_warming", "wheels", {"change": -0.3, "time": 200.0}),
    make_effect("stribeck", "steering", {"amplitude": 3.0}),
    make_effect("com_offset", "chassis", {"x": 0.1, "y": -0.05}),
    make_effect("slope", "chassis", {"angle": 0.01, "direction": 0.6}),
    make_effect("parameter_change", "m_ch", {"change": 0.1}),
    make_effect("torque_ripple", "drives", {"amplitude": 0.1, "order": 2.0}),
)


def balance(state: State, effects: Sequence[Effect], twists: Sequence[float], u: Array, p: Array) -> Any:
    """What resists less what drives (9,), from `ident.plant` alone; twists of couplings left, gears fl and rr."""
    terms = terms_of(effects)
    parameters = changed_parameters(terms, p, state)
    angles, rates, changes = (twists[start::3] for start in range(3))
    numbers = SpringNumbers()
    soft = coupling(0, (angles[0], rates[0], changes[0]), terms, parameters, numbers)
    gears = [
        gear(wheel, (angles[place], rates[place], changes[place]), terms, parameters, numbers)
        for wheel, place in ((0, 1), (3, 2))
    ]
    shaft = shaft_torques(terms, u, at_motors(gears, state.beta, "angle"))
    resisting = Resistance(terms, parameters).at(state, None, [soft])
    whole = resisting[:9] - symbolic.input_matrix() @ shaft
    for each in gears:
        whole[5 + each.place] += each.inertia * each.acceleration
    return whole


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("mode", list(Mode))
def test_accelerations_of_the_c_code_balance_the_rows_of_every_mode(
    core_of: Callable[..., Any], mode: Mode, seed: int
) -> None:
    """Whatever forces the creeping contacts give, they do no work where wheels roll: H_kᵀ (Θ p′ + f - B u′) = 0."""
    core = core_of("prototype", EFFECTS)
    geometry, generator = core.vehicle.geometry, np.random.default_rng(seed)
    posture = {
        Mode.LATERAL: np.array([-np.pi / 2, np.pi / 2]),
        Mode.ROTATION: geometry.rotation_angle * np.array([-1.0, 1.0]),
        Mode.STEERED: kinematics.steering_from_virtual(0.3 * generator.normal(size=1), geometry)[0],
    }.get(mode, generator.uniform(-1, 1, size=2))
    instance = core.new(steering_limit=1e3)
    names = [row.name for row in core.table.block(Block.STATE)]
    instance.x[:] = 0.0
    instance.x[:9] = generator.normal(size=9) * np.repeat([0.3, 1.0], [5, 4])
    twists = {
        # Its rear wheel rolls elsewhere when the coupling is twisted; the reduced model leaves that out.
        "coupling_l": (0.0, 0.1 * generator.normal()),
        "gear_fl": (0.01 * generator.normal(), generator.normal()),
        "gear_rr": (0.01 * generator.normal(), generator.normal()),
    }
    values = {f"{name}_twist": angle for name, (angle, _) in twists.items()}
    values |= {f"{name}_twist_dot": rate for name, (_, rate) in twists.items()}
    beta = generator.normal(size=4)
    values |= {f"beta_{wheel}": angle for wheel, angle in zip(("fl", "rl", "fr", "rr"), beta, strict=True)}
    instance.set(alpha_l=posture[0], alpha_r=posture[1], gamma=0.4, elapsed=150.0, **values)
    instance.u[:4] = generator.normal(size=4)
    found = dict(zip(names, instance.derivatives(), strict=True))
    changes = [found[f"{name}_twist_dot"] for name in twists]
    state = State(0.4, posture, beta, instance.x[:9].copy(), np.array([found[name] for name in names[:9]]), 150.0)
    flat = [
        number
        for (angle, rate), change in zip(twists.values(), changes, strict=True)
        for number in (angle, rate, change)
    ]
    left = balance(state, EFFECTS, flat, instance.u[:4], core.vehicle.prior.values)
    rows = ca.Function("left", [symbolic.GEOMETRY, symbolic.EPSILON], [left])
    forces = np.asarray(rows(geometry.as_vector(), COULOMB_EPSILON)).ravel()
    directions = kinematics.complement(mode, posture, geometry)[0]
    size = np.abs(directions).T @ np.abs(forces)
    assert np.abs(directions.T @ forces).max() < 1e-9 * size.max()


class _Brake(EffectTerm):
    """An addition that nobody has heard of: a torque at one wheel."""

    def forces(self, state: State, masses: Masses, parameters: Any) -> Any:
        rows = ca.SX(9, 1)
        rows[6] = 5.0 * state.rates[6]
        return rows


BRAKE: Term = _Brake("brake", "wheel_rl", {})


def evaluated(expression: Any, inputs: Sequence[Any], values: Sequence[Array], vehicle: VehicleDescription) -> Array:
    function = ca.Function("f", [*inputs, symbolic.GEOMETRY, symbolic.EPSILON], [expression])
    return np.asarray(function(*values, vehicle.geometry.as_vector(), COULOMB_EPSILON)).ravel()


def test_one_term_more_changes_rows_simulation_and_fmu_alike() -> None:
    vehicle, generator = load_vehicle(), np.random.default_rng(3)
    p, g, rate = vehicle.prior.values, vehicle.geometry, 0.7
    alpha = g.rotation_angle * np.array([-1.0, 1.0])
    H = kinematics.complement(Mode.ROTATION, alpha, g)[0]
    rates = H[:, 0] * rate
    wanted = float(H[6, 0] * 5.0 * rates[6])
    # Rows.
    z = np.zeros((1, INPUTS))
    z[0, SLICES["alpha"]], z[0, SLICES["beta_rate"]] = alpha, rates[5:]
    without, with_it = (
        Formulas(terms).exact(Channel.DYNAMIC, ROWS[Step.ROTATION])(
            z, g.as_vector(), np.array([COULOMB_EPSILON]), p, np.zeros(0)
        )
        for terms in ((), (BRAKE,))
    )
    assert (with_it - without).item() == pytest.approx(wanted, rel=1e-9)
    # Simulation: by the inertia that the mode has.
    inertia = dynamics.projected_regressor(Mode.ROTATION, alpha, np.zeros(9), H[:, 0], g)[0, 0] @ p
    angles, u = ca.SX.sym("angles", 7), ca.SX.sym("u", 4)
    velocity, symbols = ca.SX.sym("v"), ca.SX.sym("p", len(PARAMETER_NAMES))
    point = Point(angles, ca.SX(0, 1), velocity, ca.SX(0), ca.SX(0, 1))
    torques = generator.normal(size=4)
    slower = [
        evaluated(
            RollingModel(Mode.ROTATION, terms, ()).acceleration(point, u, symbols),
            [angles, velocity, u, symbols],
            [np.array([0.0, *alpha, 0, 0, 0, 0]), np.array([rate]), torques, p],
            vehicle,
        )[0]
        for terms in ((), (BRAKE,))
    ]
    assert (slower[0] - slower[1]) * inertia == pytest.approx(wanted, rel=1e-9)
    # The equations of the FMU.
    table = variable_table(vehicle, vehicle.prior)
    x, inputs, parameters = (
        Symbols(block.value, [row.name for row in table.block(block)])
        for block in (Block.STATE, Block.INPUT, Block.PARAMETER)
    )
    start = {"alpha_l": alpha[0], "alpha_r": alpha[1]} | dict(
        zip([row.name for row in table.block(Block.STATE)], rates, strict=False)
    )
    state = [start.get(row.name, 0.0) for row in table.block(Block.STATE)]
    numbers = [row.start for row in table.block(Block.PARAMETER)]
    braked = [
        np.asarray(
            ca.Function("f", [model.x, model.u, model.p], [model.xd])(state, [*torques, 0, 0, 0], numbers)
        ).ravel()[:9]
        for terms in ((), (BRAKE,))
        for model in (creeping.equations(x, inputs, parameters, terms, Inputs.TORQUE),)
    ]
    own = dynamics.regressor(np.zeros(9), braked[0] - braked[1])[0] @ p
    np.testing.assert_allclose(own, [0, 0, 0, 0, 0, 0, 5.0 * rates[6], 0, 0], atol=1e-9)
