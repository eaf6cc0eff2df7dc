"""A wheel that does not turn about its centre."""

from __future__ import annotations

from typing import Final

import casadi as ca

from ident.effects.base import EffectKind, EffectParameter, EffectTerm
from ident.plant.places import WHEEL_PLACES, with_groups
from ident.plant.symbolic import Expression
from ident.plant.terms import FIRST_WHEEL, Masses, State
from ident.vehicle.quantities import GRAVITY


def _warped_by(wheel: int) -> tuple[int, ...]:
    """Which wheels a rigid vehicle presses more, +1, and less, -1, when one of them is higher."""
    return tuple(1 if other in (wheel, len(WHEEL_PLACES) - 1 - wheel) else -1 for other in range(len(WHEEL_PLACES)))


class _Eccentricity(EffectTerm):
    def radii(self, beta: Expression) -> Expression:
        """First harmonic over the angle of the wheel; of all wheels, as far as they roll on what warp leaves."""
        more = ca.SX(4, 1)
        for wheel in self.among(WHEEL_PLACES):
            higher = self["amplitude"] * ca.cos(beta[wheel] + self["phase"])
            more[wheel] += higher
            for other, sign in enumerate(_warped_by(wheel)):
                more[other] -= sign * self["warp"] * higher / 4
        return more

    def forces(self, state: State, masses: Masses, parameters: Expression) -> Expression:
        """A quarter of the weight goes up and down with the axle: ∂/∂β of (m g/4) amplitude cos(β + phase)."""
        del parameters
        rows = ca.SX(9, 1)
        for wheel in self.among(WHEEL_PLACES):
            up = -self["amplitude"] * ca.sin(state.beta[wheel] + self["phase"])
            rows[FIRST_WHEEL + wheel] = masses.loaded * GRAVITY / 4 * up
        return rows


EFFECT: Final = EffectKind(
    name="wheel_eccentricity",
    rank=150,
    places=with_groups(WHEEL_PLACES),
    parameters=(
        EffectParameter("amplitude", "m", "first harmonic of the rolling radius over the wheel angle"),
        EffectParameter("phase", "rad", "wheel angle of the largest radius, negative", 0.0),
        EffectParameter("warp", "1", "rolling radius lost over what a tyre gives way more, as the vehicle warps", 0.0),
    ),
    term=_Eccentricity,
    words="a radius that varies by {amplitude} over a turn",
    usual=lambda vehicle, where: 0.003 * vehicle.geometry.wheel_radius,
    over=("angle", "rolling"),
    polar=("amplitude", "phase"),
)
