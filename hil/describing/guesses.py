"""Rough priors of a vehicle of which no more is known than lengths, mass and motors.

The constants are round numbers between those of the two vehicles that ship with the program (842 kg and 421 kg), which
the rules meet within their standard deviations. They plan the excitation and design the controller; none of them enters
an estimate.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from ident.vehicle.geometry import Geometry
from ident.vehicle.quantities import Quantity

GRAVITY: Final = 9.81

ROLLING_COEFFICIENT: Final = 0.02
"""Rolling friction and the gear's, over the wheel load [-]: polyurethane on concrete behind a planetary gear."""

ROLLING_VISCOUS_TIME: Final = 0.18
"""d_vw over d_cw [s/rad]: at 5 rad/s the viscous part is about as large as the Coulomb part."""

STEERING_LEVER: Final = 0.0035
"""Steering friction over the load of a side [m]: bearings and the contact patch turning on the spot."""

STEERING_VISCOUS_TIME: Final = 0.25
"""d_vl over d_cl [s/rad]."""

ROTOR_PER_TORQUE: Final = 2.3e-4
"""Inertia of rotor, brake and gear input over rated torque [kg m^2/Nm]: servos of 200 W to 2 kW."""

UNIT_SHARE: Final = 0.01
"""Mass of a steering unit over that of the vehicle [-]."""

BODY_RATIO: Final = 1.35
"""Length and width of the body over wheelbase and track width [-]."""


def guess_priors(geometry: Geometry, mass: float, rated_torque: float) -> Mapping[str, Quantity]:
    """The eleven parameters, each with its rule as source and a standard deviation that says how rough it is.

    Args:
        geometry: of the vehicle.
        mass: [kg].
        rated_torque: of a motor [Nm].
    """
    load = mass * GRAVITY / 4
    rolling = ROLLING_COEFFICIENT * load * geometry.wheel_radius
    steering = STEERING_LEVER * 2 * load
    spin = ROTOR_PER_TORQUE * rated_torque * geometry.gear_ratio**2
    unit = UNIT_SHARE * mass * (geometry.wheel_offset**2 + geometry.wheel_radius**2 / 2)
    side = spin + 2 * unit
    yaw = mass / 12 * BODY_RATIO**2 * (geometry.wheelbase**2 + geometry.track_width**2)
    inertia = f"guess: B_w + 2 {UNIT_SHARE:g} mass (wheel_offset^2 + wheel_radius^2 / 2): two units of 1 % of the mass"
    coulomb = f"guess: {STEERING_LEVER * 1e3:g} mm times the load of a side, mass g / 2"
    viscous = f"guess: {STEERING_VISCOUS_TIME:g} s/rad times the Coulomb friction of the steering"
    return {
        "C_l": _guess(side, "kg m^2", 0.5, inertia),
        "d_vl": _guess(STEERING_VISCOUS_TIME * steering, "Nm s/rad", 0.7, viscous),
        "d_cl": _guess(steering, "Nm", 0.5, coulomb),
        "C_r": _guess(side, "kg m^2", 0.5, inertia),
        "d_vr": _guess(STEERING_VISCOUS_TIME * steering, "Nm s/rad", 0.7, viscous),
        "d_cr": _guess(steering, "Nm", 0.5, coulomb),
        "m_ch": _guess(mass, "kg", 0.1, "weighed or CAD, as given"),
        "C_ch": _guess(yaw, "kg m^2", 0.3, f"guess: uniform body, {BODY_RATIO:g} times wheelbase and track width"),
        "d_vw": _guess(ROLLING_VISCOUS_TIME * rolling, "Nm s/rad", 0.6, f"guess: {ROLLING_VISCOUS_TIME:g} s/rad d_cw"),
        "d_cw": _guess(rolling, "Nm", 0.5, f"guess: {ROLLING_COEFFICIENT:g} times wheel load times wheel_radius"),
        "B_w": _guess(spin, "kg m^2", 0.4, f"guess: {ROTOR_PER_TORQUE:g} kg m^2/Nm rated_torque gear_ratio^2"),
    }


def _guess(value: float, unit: str, relative: float, rule: str) -> Quantity:
    return Quantity(float(f"{value:.4g}"), unit, rule, float(f"{relative * value:.2g}"))
