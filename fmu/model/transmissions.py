"""Gears and couplings that give way: a spring with play between motor and wheel, or between two steering units.

The law of the spring is that of `ident.vehicle.springs`, its numbers parameters of the table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from fmu.effect_states import SIDES, Memories
from fmu.model.symbols import Symbols
from ident.vehicle.effects import DRIVES, STEERING, Effect, EffectName
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.springs import damping_of, spring_torque, stiffness_of
from ident.vehicle.symbolic import LENGTHS, Expression


@dataclass(frozen=True)
class Coupling:
    """The soft coupling of a steering side.

    Attributes:
        side: 0 left, 1 right.
        twist, rate: of the front unit's angle over that of the rear unit, taken with its sign turned [rad, rad/s].
        acceleration: symbol of the derivative of `rate`.
        torque: that turns both back [Nm].
        inertia: of one unit about its axis [kg m²].
    """

    side: int
    twist: Expression
    rate: Expression
    acceleration: Expression
    torque: Expression
    inertia: Expression


@dataclass(frozen=True)
class Gear:
    """The flexible gear of a drive, at the wheel.

    Attributes:
        wheel: 0 to 3.
        twist, rate: of the motor over the wheel [rad, rad/s].
        torque: on the wheel [Nm].
        motor_inertia: part of B_w [kg m²].
    """

    wheel: int
    twist: Expression
    rate: Expression
    torque: Expression
    motor_inertia: Expression


@dataclass(frozen=True)
class Springs:
    """Parameters of the springs, by place."""

    effects: Sequence[Effect]
    p: Symbols

    def torque(self, place: str, twist: Expression, rate: Expression, reduced_inertia: Expression) -> Expression:
        """K of a place."""
        compliance = self._size(EffectName.ELASTICITY, place, "compliance")
        gap = self._size(EffectName.BACKLASH, place, "gap")
        stiffness = stiffness_of(compliance, self.p["spring_stiffness"])
        damping = damping_of(stiffness, reduced_inertia, self.p["spring_damping_ratio"])
        return spring_torque(twist, rate, stiffness, gap, damping)

    def _size(self, name: EffectName, place: str, parameter: str) -> Expression:
        there = any(effect.name is name and effect.where == place for effect in self.effects)
        return self.p[f"{name}.{place}.{parameter}"] if there else ca.SX(0)


def couplings_of(x: Symbols, springs: Springs, memories: Memories, parameters: Expression) -> tuple[Coupling, ...]:
    """The soft couplings; from the parameters p′ (11,)."""
    couplings = []
    for side in memories.couplings:
        twist, rate = x[f"coupling_{SIDES[side]}_twist"], x[f"coupling_{SIDES[side]}_twist_dot"]
        unit = parameters[PARAMETER_NAMES.index(f"C_{SIDES[side]}")] / 2
        torque = springs.torque(STEERING[side], twist, rate, unit / 2)
        couplings.append(Coupling(side, twist, rate, ca.SX.sym(f"tdd_{side}"), torque, unit))
    return tuple(couplings)


def gears_of(x: Symbols, springs: Springs, memories: Memories, parameters: Expression) -> tuple[Gear, ...]:
    """The flexible gears; from the parameters p′ (11,)."""
    gears = []
    for wheel in memories.gears:
        twist, rate = x[f"gear_{WHEELS[wheel]}_twist"], x[f"gear_{WHEELS[wheel]}_twist_dot"]
        share = springs.p["motor_share"]
        motor = share * parameters[PARAMETER_NAMES.index("B_w")]
        torque = springs.torque(DRIVES[wheel], twist, rate, (1 - share) * motor)
        gears.append(Gear(wheel, twist, rate, torque, motor))
    return tuple(gears)


def at_motors(gears: Sequence[Gear], wheels: Expression, name: str) -> Expression:
    """Angles or rates (4,) of the motors, at the wheel, from those of the wheels; `name` is `twist` or `rate`."""
    motors = ca.SX(wheels)
    for gear in gears:
        motors[gear.wheel] += getattr(gear, name)
    return motors


def transmitted_torques(gears: Sequence[Gear], shaft_torques: Expression) -> Expression:
    """Torques (4,) that reach the wheels, over the gear ratio [Nm]."""
    transmitted = ca.SX(shaft_torques)
    for gear in gears:
        transmitted[gear.wheel] = gear.torque / LENGTHS.i_G
    return transmitted


def twist_accelerations(gears: Sequence[Gear], shaft_torques: Expression, wheels: Expression) -> Expression:
    """Second derivatives of the twists of the gears [rad/s²], from β̈ (4,) of the wheels."""
    return ca.vertcat(
        *(
            (LENGTHS.i_G * shaft_torques[gear.wheel] - gear.torque) / gear.motor_inertia - wheels[gear.wheel]
            for gear in gears
        )
    )
