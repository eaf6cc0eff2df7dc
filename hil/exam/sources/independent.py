"""A vehicle from first principles, in numpy: bodies, contacts that creep, and friction laws of its own.

Nothing of `ident.vehicle` but the lengths of the vehicle file is in it, and nothing of the emulator. Many segments are
driven side by side. Velocities q̇ = (v_x, v_y, ω, α̇_l, α̇_r, β̇_fl, β̇_rl, β̇_fr, β̇_rr[, motor fl]) follow from

    M q̇⁺ = M q̇ + h (B u - friction - centripetal - gravity - Jᵀ c J q̇⁺)

with the contact slips J q̇ at the end of a step (backward), friction that varies smoothly and the twist of a gear in its
middle (trapezoidal), and dry friction at its end. Torques ramp from sample to sample, as recorded. Loads on the wheels
are equal and do not shift.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ident.vehicle.description import VehicleDescription

Array = NDArray[np.float64]
Resisting = Callable[[Array, Array, Array, float], Array]
"""alpha (R, 2), beta (R, 4), velocity (R, 9), time [s] -> torques (R, 9) on q that resist, beside everything else."""

NOWHERE = (0.0, 0.0, 0.0, 0.0)

STEP, CYCLE = 1e-3, 2e-3
CREEP = 2e6
"""Contact force per slip [N s/m]."""
SHARP = 2e-3
"""Rate over which dry friction changes its sign [rad/s]."""
GRAVITY = 9.80665
FRONT, SIDE = np.array([1, -1, 1, -1]), np.array([1, 1, -1, -1])
WHEELS = slice(5, 9)


@dataclass(frozen=True)
class LuGre:
    """Bristles at a steering axis (Canudas de Wit, Olsson, Åström, Lischinsky 1995) in place of its dry friction.

    Attributes:
        side: 0 left, 1 right.
        breakaway: friction at rest beyond that in motion [Nm].
        velocity: of Stribeck [rad/s].
        stiffness: of the bristles [Nm/rad].
    """

    side: int
    breakaway: float
    velocity: float
    stiffness: float = 2e4


@dataclass(frozen=True)
class Truth:
    """The vehicle.

    Attributes:
        parameters: by the symbols of (18).
        bristles: or None for dry friction everywhere.
        compliance: between motor and one wheel, two equal masses [rad/Nm]; zero for a rigid gear.
        soft: number of that wheel.
        resists: what resists beside all that, or None.
        dry: how much larger the dry friction of every row is, or None; as `resists`.
        late: cycles by which all torques are reported late.
        larger: radii of the wheels beyond that of the vehicle file [m].
        off_centre: centre of every wheel off its axle [m], rolling radius r + off_centre cos(beta + phase).
        phase: [rad].
        patch: dry torque of every contact patch against turning about the vertical [Nm].
        loss: share of the torque through the gear by which the dry friction of each wheel is larger.
        dahl: rows of q that have bristles beside all that, as (row, friction [Nm], angle that they bend over [rad]).
        slope, uphill: inclination of the floor, and the heading that points up it [rad].
    """

    parameters: Mapping[str, float] = field(
        default_factory=lambda: {
            "C_l": 0.33,
            "d_vl": 2.6,
            "d_cl": 13.0,
            "C_r": 0.36,
            "d_vr": 2.9,
            "d_cr": 14.0,
            "m_ch": 845.0,
            "C_ch": 288.0,
            "d_vw": 0.55,
            "d_cw": 3.2,
            "B_w": 0.121,
        }
    )
    bristles: LuGre | None = None
    compliance: float = 0.0
    soft: int = 0
    resists: Resisting | None = None
    dry: Resisting | None = None
    late: int = 0
    larger: tuple[float, ...] = NOWHERE
    off_centre: tuple[float, ...] = NOWHERE
    phase: tuple[float, ...] = NOWHERE
    patch: tuple[float, ...] = NOWHERE
    loss: tuple[float, ...] = NOWHERE
    dahl: tuple[tuple[int, float, float], ...] = ()
    slope: float = 0.0
    uphill: float = 0.0


class Plant:
    """R vehicles of one kind, each in a segment of its own.

    Args:
        truth: of them all.
        vehicle: its lengths.
        alpha: steering angles at the start (R, 2) [rad].
    """

    def __init__(self, truth: Truth, vehicle: VehicleDescription, alpha: Array) -> None:
        p, g = truth.parameters, vehicle.geometry
        self.truth, self.geometry, self.alpha = truth, g, alpha.copy()
        runs, self.soft = len(alpha), truth.compliance > 0
        yaw = p["C_ch"] + p["C_l"] + p["C_r"]
        inertia = np.array([p["m_ch"], p["m_ch"], yaw, p["C_l"], p["C_r"], *[p["B_w"]] * 4])
        if self.soft:
            inertia = np.append(inertia, p["B_w"] / 2)
            inertia[5 + truth.soft] /= 2
        self.mass = inertia
        self.velocity = np.zeros((runs, len(inertia)))
        self.beta, self.twist, self.bristle = np.zeros((runs, 4)), np.zeros(runs), np.zeros(runs)
        self.heading = np.zeros(runs)
        self.bent = np.zeros((runs, len(truth.dahl)))
        self.viscous, self.dry = np.zeros((2, len(inertia)))
        self.viscous[3:9] = [p["d_vl"], p["d_vr"], *[p["d_vw"]] * 4]
        self.dry[3:9] = [p["d_cl"], p["d_cr"], *[p["d_cw"]] * 4]
        self.axes = np.stack([FRONT * g.wheelbase / 2, SIDE * g.track_width / 2], axis=1)

    def slips(self) -> Array:
        """J (R, 8, n): velocities of the contact points over the floor, along the four wheels and across them."""
        g, heading = self.geometry, self.alpha[:, [0, 0, 1, 1]] * FRONT
        along = np.stack([np.cos(heading), np.sin(heading)], axis=2)
        across = np.stack([-along[..., 1], along[..., 0]], axis=2)
        contact = self.axes + g.wheel_offset * SIDE[:, None] * across
        jacobian = np.zeros((len(heading), 8, len(self.mass)))
        for rows, direction in ((slice(0, 4), along), (slice(4, 8), across)):
            jacobian[:, rows, :2] = direction
            jacobian[:, rows, 2] = direction[..., 1] * contact[..., 0] - direction[..., 0] * contact[..., 1]
        for wheel in range(4):
            # The unit turns about its axis, the contact lies beside it: it moves along the wheel.
            jacobian[:, wheel, 3 + wheel // 2] = -g.wheel_offset * SIDE[wheel] * FRONT[wheel]
            turned = self.beta[:, wheel] + self.truth.phase[wheel]
            radius = g.wheel_radius + self.truth.larger[wheel] + self.truth.off_centre[wheel] * np.cos(turned)
            jacobian[:, wheel, 5 + wheel] = -radius
        return jacobian

    def advance(self, torques: Array, disturbance: Array, time: float) -> None:
        """One step at a time [s], under motor torques (R, 4) and torques on q (R, 9) that no drive reports."""
        v, h = self.velocity, STEP
        through = self._through(torques)
        load = np.zeros_like(v)
        load[:, :9] = disturbance
        if self.truth.resists is not None:
            load[:, :9] -= self.truth.resists(self.alpha, self.beta, v[:, :9], time)
        if self.soft:
            load[:, 9] = self.geometry.gear_ratio * torques[:, self.truth.soft]
            torques = np.where(np.arange(4) == self.truth.soft, 0.0, torques)
        load[:, WHEELS] += self.geometry.gear_ratio * torques
        self._weigh(load)
        turn = v[:, 2]
        load[:, 0] += self.mass[0] * v[:, 1] * turn
        load[:, 1] -= self.mass[0] * v[:, 0] * turn
        jacobian = self.slips()
        matrix = h * CREEP * np.swapaxes(jacobian, 1, 2) @ jacobian
        diagonal = self.mass + h * self.viscous / 2
        load -= self.viscous / 2 * v
        dry = self._dry(time, through)
        root = np.sqrt(v**2 + SHARP**2)
        slope = dry * SHARP**2 / root**3
        load += -dry * v / root + slope * v
        implicit = np.broadcast_to(diagonal, v.shape) + h * slope
        implicit, load = self._with_bristles(implicit, load)
        implicit, load = self._with_dahl(implicit, load)
        index = np.arange(len(self.mass))
        matrix[:, index, index] += implicit
        self._scrub(matrix, load)
        right = self.mass * v + h * load
        if self.soft:
            self._add_spring(matrix, right)
        after = np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0], dtype=np.float64)
        self._move(v, after)

    def _through(self, torques: Array) -> Array:
        """Torques through the gears (R, 4), at the wheels [Nm]: those of the motors, or that of the spring."""
        through = self.geometry.gear_ratio * torques
        if self.soft:
            rate = self.velocity[:, 9] - self.velocity[:, 5 + self.truth.soft]
            stiffness, damping = self._spring()
            through[:, self.truth.soft] = stiffness * self.twist + damping * rate
        return through

    def _dry(self, time: float, through: Array) -> Array:
        """Dry friction (R, n) [Nm]."""
        dry = np.broadcast_to(self.dry, self.velocity.shape).copy()
        if self.truth.dry is not None:
            dry[:, :9] += self.truth.dry(self.alpha, self.beta, self.velocity[:, :9], time)
        dry[:, WHEELS] += np.array(self.truth.loss) * np.abs(through)
        return np.maximum(dry, 0.0)

    def _weigh(self, load: Array) -> None:
        """Gravity along the floor, and what the weight on a wheel off its centre turns."""
        weight = self.truth.parameters["m_ch"] * GRAVITY
        if self.truth.slope:
            towards = self.truth.uphill - self.heading
            load[:, 0] -= weight * np.sin(self.truth.slope) * np.cos(towards)
            load[:, 1] -= weight * np.sin(self.truth.slope) * np.sin(towards)
        if any(self.truth.off_centre):
            off, phase = np.array(self.truth.off_centre), np.array(self.truth.phase)
            load[:, WHEELS] += weight / 4 * off * np.sin(self.beta + phase)

    def _scrub(self, matrix: Array, load: Array) -> None:
        """Contact patches that turn about the vertical: dry friction at the end of the step."""
        for wheel, torque in enumerate(self.truth.patch):
            if not torque:
                continue
            turned = np.zeros(len(self.mass))
            turned[2], turned[3 + wheel // 2] = 1.0, FRONT[wheel]
            rate = self.velocity @ turned
            root = np.sqrt(rate**2 + SHARP**2)
            slope = torque * SHARP**2 / root**3
            load += np.outer(-torque * rate / root + slope * rate, turned)
            matrix += STEP * slope[:, None, None] * np.outer(turned, turned)

    def _with_bristles(self, implicit: Array, load: Array) -> tuple[Array, Array]:
        """LuGre with its bristles at the end of the step: z⁺ = (z + h v⁺)/(1 + h σ₀ |v|/g)."""
        law = self.truth.bristles
        if law is None:
            return implicit, load
        row, v = 3 + law.side, self.velocity[:, 3 + law.side]
        root = np.sqrt(v**2 + SHARP**2)
        slope = self.dry[row] * SHARP**2 / root**3
        load[:, row] += self.dry[row] * v / root - slope * v
        implicit = implicit.copy()
        implicit[:, row] -= STEP * slope
        kept = 1 / (1 + STEP * law.stiffness * np.abs(v) / self._height(law, v))
        damping = 0.3 * np.sqrt(law.stiffness)
        # σ₀ z⁺ + σ₁ (z⁺ - z)/h, z⁺ = kept (z + h v⁺)
        load[:, row] -= (law.stiffness * kept + damping * (kept - 1) / STEP) * self.bristle
        implicit[:, row] += STEP * (law.stiffness * STEP + damping) * kept
        return implicit, load

    def _with_dahl(self, implicit: Array, load: Array) -> tuple[Array, Array]:
        """Dahl's bristles at the end of the step: T z⁺, z⁺ = kept (z + h v⁺/angle)."""
        implicit = implicit.copy() if self.truth.dahl else implicit
        for place, (row, torque, angle) in enumerate(self.truth.dahl):
            kept = 1 / (1 + STEP * np.abs(self.velocity[:, row]) / angle)
            load[:, row] -= torque * kept * self.bent[:, place]
            implicit[:, row] += STEP * torque * kept * STEP / angle
        return implicit, load

    def _height(self, law: LuGre, v: Array) -> Array:
        return np.asarray(self.dry[3 + law.side] + law.breakaway * np.exp(-((v / law.velocity) ** 2)))

    def _spring(self) -> tuple[float, float]:
        """Stiffness and damping of the gear that gives way [Nm/rad, Nm s/rad]."""
        stiffness = 1 / self.truth.compliance
        return stiffness, 0.1 * float(np.sqrt(stiffness * self.truth.parameters["B_w"] / 4))

    def _add_spring(self, matrix: Array, right: Array) -> None:
        """K at the middle of the step, by the trapezoidal rule, on motor (+) and wheel (-)."""
        stiffness, damping = self._spring()
        wheel = 5 + self.truth.soft
        rate = self.velocity[:, 9] - self.velocity[:, wheel]
        now = stiffness * (self.twist + STEP / 4 * rate) + damping / 2 * rate
        ahead = STEP * (stiffness * STEP / 4 + damping / 2)
        for row, sign in ((9, 1.0), (wheel, -1.0)):
            right[:, row] -= STEP * sign * now
            matrix[:, row, 9] += sign * ahead
            matrix[:, row, wheel] -= sign * ahead

    def _move(self, before: Array, after: Array) -> None:
        middle = STEP / 2 * (before + after)
        self.alpha += middle[:, 3:5]
        self.beta += middle[:, WHEELS]
        self.heading += middle[:, 2]
        if self.soft:
            self.twist += middle[:, 9] - middle[:, 5 + self.truth.soft]
        law = self.truth.bristles
        if law is not None:
            v = before[:, 3 + law.side]
            kept = 1 / (1 + STEP * law.stiffness * np.abs(v) / self._height(law, v))
            self.bristle = kept * (self.bristle + STEP * after[:, 3 + law.side])
        for place, (row, _, angle) in enumerate(self.truth.dahl):
            kept = 1 / (1 + STEP * np.abs(before[:, row]) / angle)
            self.bent[:, place] = kept * (self.bent[:, place] + STEP * after[:, row] / angle)
        self.velocity = after

    def read(self) -> tuple[Array, Array]:
        """Angles of the motors, at the wheels (R, 4), and of the front units (R, 2) [rad]."""
        motors = self.beta.copy()
        motors[:, self.truth.soft] += self.twist
        return motors, self.alpha.copy()
