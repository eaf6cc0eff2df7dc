"""The equations of the platform, written once, symbolically (paper, equations (1)-(21)).

Everything numeric, the numpy functions of this package and any generated code, is made from these.

| symbol | here | shape | unit |
|---|---|---|---|
| l, b, a, r, i_G | `geometry` | (5,) | m, m, m, m, - |
| q̇ = (ẋ, ẏ, γ̇, α̇, β̇) | `rates` | (9,) | chassis frame: m/s, m/s, rad/s; then rad/s |
| q̈ | `accelerations` | (9,) | derivatives of `rates` |
| α = (α_l, α_r) | `alpha` | (2,) | rad, angles of the FRONT wheels; the rear ones stand at -α |
| u | `motor_torques` | (4,) | Nm at the motor shaft |

ẋ, ẏ are velocities in the chassis frame, so the centripetal terms of (16) carry γ̇ explicitly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import casadi as ca

from ident.plant.modes import Mode
from ident.vehicle.parameters import PARAMETER_NAMES

Expression = Any  # casadi.SX has no type stubs

CORNERS: Final = ((+1, +1), (-1, +1), (+1, -1), (-1, -1))
"""Signs of (x_i, y_i) of the steering axes, order fl, rl, fr, rr; also heading and side sign."""

GEOMETRY: Final = ca.SX.sym("geometry", 5)
EPSILON: Final = ca.SX.sym("epsilon")


@dataclass(frozen=True)
class Lengths:
    """The geometry vector by the paper's symbols."""

    l: Expression  # noqa: E741
    b: Expression
    a: Expression
    r: Expression
    i_G: Expression  # noqa: N815


LENGTHS: Final = Lengths(*ca.vertsplit(GEOMETRY))


def wheel_headings(alpha: Expression) -> Expression:
    """δ (4,) of the wheels in the chassis: +α of their side in front, -α behind."""
    return ca.vertcat(*(front * (alpha[0] if side > 0 else alpha[1]) for front, side in CORNERS))


def contact_rows(headings: Expression) -> Expression:
    """A_ch of (2) for wheel headings δ (4,), (8, 3): velocities of the contacts across, then along the wheels."""
    lateral, longitudinal = [], []
    for wheel, (x_sign, side) in enumerate(CORNERS):
        delta = headings[wheel]
        tangent = ca.vertcat(ca.cos(delta), ca.sin(delta))
        normal = ca.vertcat(-ca.sin(delta), ca.cos(delta))
        lever = ca.vertcat(-side * LENGTHS.b / 2, x_sign * LENGTHS.l / 2)
        lateral.append(ca.horzcat(normal.T, ca.dot(normal, lever)))
        longitudinal.append(ca.horzcat(tangent.T, ca.dot(tangent, lever) - LENGTHS.a * side))
    return ca.vertcat(*lateral, *longitudinal)


def constraint_matrix(alpha: Expression) -> Expression:
    """A(α) of (2), (8, 9): four lateral rows, then four longitudinal rows."""
    joints = ca.SX.zeros(8, 6)
    for wheel, (front, side) in enumerate(CORNERS):
        joints[4 + wheel, 0 if side > 0 else 1] = -LENGTHS.a * side * front
        joints[4 + wheel, 2 + wheel] = -LENGTHS.r
    return ca.horzcat(contact_rows(wheel_headings(alpha)), joints)


def odometry(alpha: Expression, steering_rates: Expression, wheel_rates: Expression) -> Expression:
    """Twist in the chassis frame by (3), (3,)."""
    A = constraint_matrix(alpha)
    A_ch, A_alpha, A_beta = A[:, :3], A[:, 3:5], A[:, 5:]
    return -ca.solve(A_ch.T @ A_ch, A_ch.T @ (A_alpha @ steering_rates + A_beta @ wheel_rates))


def steering_from_virtual(alpha_v: Expression) -> Expression:
    """f_ICR of (8), from (6) corrected: the two steering angles of a virtual single track, (2,)."""
    tangent = ca.tan(alpha_v)
    half_l, half_b = LENGTHS.l / 2, LENGTHS.b / 2
    return ca.vertcat(
        ca.atan(half_l * tangent / (half_l - half_b * tangent)),
        ca.atan(half_l * tangent / (half_l + half_b * tangent)),
    )


def virtual_from_steering(alpha: Expression) -> Expression:
    """α_v whose curvature is the mean of the curvatures that left and right angle ask for, ()."""
    half_l, half_b = LENGTHS.l / 2, LENGTHS.b / 2
    left = ca.tan(alpha[0]) / (half_l + half_b * ca.tan(alpha[0]))
    right = ca.tan(alpha[1]) / (half_l - half_b * ca.tan(alpha[1]))
    return ca.atan(half_l * (left + right) / 2)


def mode_distances(alpha: Expression, tolerance: Expression) -> Expression:
    """Conditions of (9) (4,), without poles.

    k is 4 where the first is negative, else 3 where the second is, else 2 where the last two are, else 1. Mode 4 comes
    first, since its angles satisfy the condition of mode 2 as well.
    """
    half_l, b = LENGTHS.l / 2, LENGTHS.b
    left, right = alpha[0], alpha[1]

    def corner(angle: Expression) -> Expression:
        return ca.fmax(ca.fabs(left + angle), ca.fabs(right - angle)) - tolerance

    residual, slope = _centres_apart(alpha)
    sin_l, cos_l, sin_r, cos_r = ca.sin(left), ca.cos(left), ca.sin(right), ca.cos(right)
    lever_l, lever_r = half_l * cos_l + b / 2 * sin_l, half_l * cos_r - b / 2 * sin_r
    outside_track = ca.fabs(sin_l * lever_r + sin_r * lever_l) - 4 / b * ca.fabs(lever_l * lever_r)
    off_centre = ca.fabs(residual) - tolerance * slope
    return ca.vertcat(corner(ca.atan2(LENGTHS.l, b)), corner(ca.pi / 2), off_centre, outside_track)


def _centres_apart(alpha: Expression) -> tuple[Expression, Expression]:
    """f_ICR of (9) and the length of its gradient: their ratio is the angular distance from the curve, first order.

    The form (l/2) sin(α_r - α_l) + b sin α_l sin α_r = 0 is regular: it has no ∞ - ∞ straight ahead.
    """
    half_l, b = LENGTHS.l / 2, LENGTHS.b
    turn, left, right = alpha[1] - alpha[0], alpha[0], alpha[1]
    residual = half_l * ca.sin(turn) + b * ca.sin(left) * ca.sin(right)
    by_left = -half_l * ca.cos(turn) + b * ca.cos(left) * ca.sin(right)
    by_right = half_l * ca.cos(turn) + b * ca.sin(left) * ca.cos(right)
    return residual, ca.sqrt(by_left**2 + by_right**2)


def _rolling(alpha: Expression, twist: Expression, steering_rates: Expression) -> Expression:
    """Wheel rates that satisfy the longitudinal rows of (1), (4, n)."""
    rows = constraint_matrix(alpha)[4:, :]
    return (rows[:, :3] @ twist + rows[:, 3:5] @ steering_rates) / LENGTHS.r


def _complement(alpha: Expression, twist: Expression, steering_rates: Expression) -> Expression:
    return ca.vertcat(twist, steering_rates, _rolling(alpha, twist, steering_rates))


def _rotation_angles() -> Expression:
    angle = ca.atan(LENGTHS.l / LENGTHS.b)
    return ca.vertcat(-angle, angle)


def _complement_alignment(alpha: Expression) -> Expression:
    return _complement(alpha, ca.SX.zeros(3, 2), ca.SX.eye(2))


def _complement_steered(alpha: Expression) -> Expression:
    alpha_v = virtual_from_steering(alpha)
    virtual = ca.SX.sym("alpha_v")
    gradient = ca.substitute(ca.jacobian(steering_from_virtual(virtual), virtual), virtual, alpha_v)
    curvature = ca.tan(alpha_v) / (LENGTHS.l / 2)
    twist = ca.horzcat(ca.SX.zeros(3, 1), ca.vertcat(1, 0, curvature))
    steering = ca.horzcat(gradient, ca.SX.zeros(2, 1))
    return _complement(steering_from_virtual(alpha_v), twist, steering)


def _complement_lateral(alpha: Expression) -> Expression:
    quarter = ca.pi / 2
    return _complement(ca.vertcat(-quarter, quarter), ca.SX([0, 1, 0]), ca.SX.zeros(2, 1))


def _complement_rotation(alpha: Expression) -> Expression:
    return _complement(_rotation_angles(), ca.SX([0, 0, 1]), ca.SX.zeros(2, 1))


_COMPLEMENTS: Final[dict[Mode, Callable[[Expression], Expression]]] = {
    Mode.ALIGNMENT: _complement_alignment,
    Mode.STEERED: _complement_steered,
    Mode.LATERAL: _complement_lateral,
    Mode.ROTATION: _complement_rotation,
}


def complement(mode: Mode, alpha: Expression) -> Expression:
    """H_k(α) of (4), (9, n_k), with ṡ_k of (10)-(13). In modes 3 and 4 the angles are those of (9)."""
    return _COMPLEMENTS[mode](alpha)


def complement_rate(mode: Mode, alpha: Expression, steering_rates: Expression) -> Expression:
    """Ḣ_k(α, α̇) of (20), (9, n_k)."""
    H = complement(mode, alpha)
    columns = [ca.jtimes(H[:, column], alpha, steering_rates) for column in range(H.shape[1])]
    return ca.horzcat(*columns)


def regressor(rates: Expression, accelerations: Expression) -> Expression:
    """Θ(q, q̇, q̈) of (15), (16), (9, 11), columns in the order of (18)."""
    theta = ca.SX.zeros(9, len(PARAMETER_NAMES))
    column = PARAMETER_NAMES.index
    theta[0, column("m_ch")] = accelerations[0] - rates[1] * rates[2]
    theta[1, column("m_ch")] = accelerations[1] + rates[0] * rates[2]
    for inertia in ("C_ch", "C_l", "C_r"):
        theta[2, column(inertia)] = accelerations[2]
    for row, names in ((3, ("C_l", "d_vl", "d_cl")), (4, ("C_r", "d_vr", "d_cr"))):
        _axis(theta, row, names, rates, accelerations)
    for row in range(5, 9):
        _axis(theta, row, ("B_w", "d_vw", "d_cw"), rates, accelerations)
    return theta


def _axis(
    theta: Expression, row: int, names: tuple[str, str, str], rates: Expression, accelerations: Expression
) -> None:
    """Inertia, viscous and Coulomb friction of one rotating axis."""
    terms = (accelerations[row], rates[row], ca.tanh(rates[row] / EPSILON))
    for name, term in zip(names, terms, strict=True):
        theta[row, PARAMETER_NAMES.index(name)] = term


def input_matrix() -> Expression:
    """B of (17), (9, 4)."""
    return ca.vertcat(ca.SX.zeros(5, 4), LENGTHS.i_G * ca.SX.eye(4))
