"""Vehicles for all tests of `ident`: a campaign that the model fits, and records that share no code with the model.

A vehicle from first principles, in numpy: bodies, contacts that creep, and friction laws of its own.

Nothing of `ident.vehicle` but the lengths of the vehicle file is in it, and nothing of the emulator. Many segments are
driven side by side. Velocities q̇ = (v_x, v_y, ω, α̇_l, α̇_r, β̇_fl, β̇_rl, β̇_fr, β̇_rr[, motor fl]) follow from

    M q̇⁺ = M q̇ + h (B u - friction - centripetal - Jᵀ c J q̇⁺)

with the contact slips J q̇ at the end of a step (backward), friction that varies smoothly and the twist of a gear in its
middle (trapezoidal), and dry friction at its end. Torques ramp from sample to sample, as recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from ident.campaign.axis import axis_of
from ident.campaign.excitation import resting_projection, series_of
from ident.campaign.optimise import Excitation, Problem, size_within_limits
from ident.campaign.plan import Plan, assemble_plan
from ident.campaign.reference import STEERING_LOOPS, Reference
from ident.campaign.steps import EXCITATIONS
from ident.estimate.filters import Processing
from ident.estimate.identify import identify
from ident.estimate.result import Identification
from ident.plant import dynamics, kinematics
from ident.plant.kinematics import virtual_steering
from ident.plant.modes import Mode
from ident.records.record import Record, Segment, Step, make_segment
from ident.report.paper import load_paper_result
from ident.vehicle.description import VehicleDescription, load_vehicle
from ident.vehicle.geometry import Geometry
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]

STEP, CYCLE = 1e-3, 2e-3
CREEP = 2e6
"""Contact force per slip [N s/m]."""
SHARP = 2e-3
"""Rate over which dry friction changes its sign [rad/s]."""
FRONT, SIDE = np.array([1, -1, 1, -1]), np.array([1, 1, -1, -1])
WHEELS = slice(5, 9)
STEPS = ("steering_left", "steering_right", "straight", "rotation")


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
        compliance: between motor and wheel fl, two equal masses [rad/Nm]; zero for a rigid gear.
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
            inertia[5] /= 2
        self.mass = inertia
        self.velocity = np.zeros((runs, len(inertia)))
        self.beta, self.twist, self.bristle = np.zeros((runs, 4)), np.zeros(runs), np.zeros(runs)
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
            jacobian[:, wheel, 5 + wheel] = -g.wheel_radius
        return jacobian

    def advance(self, torques: Array, disturbance: Array) -> None:
        """One step under motor torques (R, 4) in its middle and torques on q (R, 9) that no drive reports."""
        v, h = self.velocity, STEP
        load = np.zeros_like(v)
        load[:, :9] = disturbance
        load[:, WHEELS] += self.geometry.gear_ratio * torques
        if self.soft:
            load[:, 9] = load[:, 5]
            load[:, 5] = 0.0
        turn = v[:, 2]
        load[:, 0] += self.mass[0] * v[:, 1] * turn
        load[:, 1] -= self.mass[0] * v[:, 0] * turn
        jacobian = self.slips()
        matrix = h * CREEP * np.swapaxes(jacobian, 1, 2) @ jacobian
        diagonal = self.mass + h * self.viscous / 2
        load -= self.viscous / 2 * v
        root = np.sqrt(v**2 + SHARP**2)
        slope = self.dry * SHARP**2 / root**3
        load += -self.dry * v / root + slope * v
        implicit = np.broadcast_to(diagonal, v.shape) + h * slope
        implicit, load = self._with_bristles(implicit, load)
        index = np.arange(len(self.mass))
        matrix[:, index, index] += implicit
        right = self.mass * v + h * load
        if self.soft:
            self._add_spring(matrix, right)
        after = np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0], dtype=np.float64)
        self._move(v, after)

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

    def _height(self, law: LuGre, v: Array) -> Array:
        return np.asarray(self.dry[3 + law.side] + law.breakaway * np.exp(-((v / law.velocity) ** 2)))

    def _add_spring(self, matrix: Array, right: Array) -> None:
        """K at the middle of the step, by the trapezoidal rule, on motor (+) and wheel (-)."""
        stiffness = 1 / self.truth.compliance
        damping = 0.1 * np.sqrt(stiffness * self.truth.parameters["B_w"] / 4)
        rate = self.velocity[:, 9] - self.velocity[:, 5]
        now = stiffness * (self.twist + STEP / 4 * rate) + damping / 2 * rate
        ahead = STEP * (stiffness * STEP / 4 + damping / 2)
        for row, sign in ((9, 1.0), (5, -1.0)):
            right[:, row] -= STEP * sign * now
            matrix[:, row, 9] += sign * ahead
            matrix[:, row, 5] -= sign * ahead

    def _move(self, before: Array, after: Array) -> None:
        middle = STEP / 2 * (before + after)
        self.alpha += middle[:, 3:5]
        self.beta += middle[:, WHEELS]
        if self.soft:
            self.twist += middle[:, 9] - middle[:, 5]
        law = self.truth.bristles
        if law is not None:
            v = before[:, 3 + law.side]
            kept = 1 / (1 + STEP * law.stiffness * np.abs(v) / self._height(law, v))
            self.bristle = kept * (self.bristle + STEP * after[:, 3 + law.side])
        self.velocity = after

    def read(self) -> tuple[Array, Array]:
        """Angles of the motors, at the wheels (R, 4), and of the front units (R, 2) [rad]."""
        motors = self.beta.copy()
        motors[:, 0] += self.twist
        return motors, self.alpha.copy()


@dataclass(frozen=True)
class Course:
    """What a segment is driven along.

    Attributes:
        step: its name.
        position: (N,) of its coordinate [rad or m].
        period: (N,).
    """

    step: str
    position: Array
    period: NDArray[np.int64]


_WIDTH = {"steering_left": 0.9, "steering_right": 0.9, "straight": 1.1, "rotation": 1.0}
"""Largest speed of the coordinate [rad/s or m/s]."""


def course(step: str, generator: np.random.Generator, periods: int, length: float = 4.0) -> Course:
    """Five harmonics, repeated, after a quarter of a period in which they swell."""
    samples, lead = round(length / CYCLE), round(length / 4 / CYCLE)
    time = np.arange(-lead, periods * samples) * CYCLE
    harmonics = np.arange(1, 6)
    phase, size = generator.uniform(0, 2 * np.pi, 5), generator.uniform(0.5, 1.0, 5) / harmonics
    omega = 2 * np.pi / length * harmonics
    wave = np.sin(omega * time[:, None] + phase) @ size
    rate = (omega * np.cos(omega * time[:, None] + phase)) @ size
    wave *= _WIDTH[step] / np.abs(rate).max()
    swell = np.clip(1 + time / (length / 4), 0, 1)
    period = np.concatenate([np.full(lead, -1), np.repeat(np.arange(periods), samples)])
    return Course(step, wave * swell**3 * (10 - 15 * swell + 6 * swell**2), period)


def drive(
    truth: Truth, vehicle: VehicleDescription, courses: list[Course], generator: np.random.Generator
) -> list[Segment]:
    """Follow the courses side by side; gains are those of a careful commissioning engineer."""
    g, runs, samples = vehicle.geometry, len(courses), len(courses[0].position)
    turned = np.array([float(each.step == "rotation") for each in courses])[:, None]
    plant = Plant(truth, vehicle, turned * g.rotation_angle * np.array([-1.0, 1.0]))
    held, lever = plant.alpha.copy(), g.wheel_offset / g.wheel_radius
    wanted = np.stack([each.position for each in courses], axis=1)
    rolling = np.array([each.step in ("straight", "rotation") for each in courses])
    sense = np.where(turned > 0, -SIDE, 1) * rolling[:, None]
    arm = np.where(turned[:, 0] > 0, g.rotation_lever, 1.0) / g.wheel_radius
    steered = np.array([[each.step == "steering_left", each.step == "steering_right"] for each in courses])
    heavy = np.where(turned[:, 0] > 0, truth.parameters["C_ch"], truth.parameters["m_ch"])
    torques, read = np.zeros((samples, runs, 4)), [np.zeros((samples, runs, n)) for n in (4, 2)]
    acting, slow = np.zeros((runs, 4)), np.zeros((runs, 4))
    previous = (plant.read()[0], plant.alpha.copy())
    memory = np.exp(-CYCLE / 0.1)
    for sample in range(samples):
        motors, alpha = plant.read()
        torques[sample], read[0][sample], read[1][sample] = acting, motors, alpha
        rates = (motors - previous[0]) / CYCLE, (alpha - previous[1]) / CYCLE
        previous = (motors, alpha)
        ahead = wanted[min(sample + 1, samples - 1)]
        speed = (ahead - wanted[max(sample - 1, 0)]) / (2 * CYCLE)
        moved, moving = (np.sum(sense * each, axis=1) / 4 / arm for each in (motors, rates[0]))
        pull = rolling * heavy * (60 * (wanted[sample] - moved) + 15 * (speed - moving))
        turn = 400 * (held + steered * wanted[sample][:, None] - alpha) + 20 * (steered * speed[:, None] - rates[1])
        each = sense * (pull / arm / 4)[:, None] + np.stack([-turn[:, 0], turn[:, 0], turn[:, 1], -turn[:, 1]], 1) / (
            2 * lever
        )
        target = np.clip(each / g.gear_ratio, -3.8, 3.8)
        slow = memory * slow + np.sqrt(1 - memory**2) * generator.normal(size=slow.shape)
        disturbance = np.zeros((runs, 9))
        disturbance[:, WHEELS] = 0.1 * slow
        parts = round(CYCLE / STEP)
        for part in range(parts):
            plant.advance(acting + (target - acting) * (part + 0.5) / parts, disturbance)
        acting = target
    return [_segment(each, index, torques, read, generator) for index, each in enumerate(courses)]


def _segment(each: Course, index: int, torques: Array, read: list[Array], generator: np.random.Generator) -> Segment:
    def noisy(values: Array, size: float) -> Array:
        return np.asarray(values[:, index] + size * generator.normal(size=values[:, index].shape))

    time = np.arange(len(each.position), dtype=np.float64) * CYCLE
    return Segment(
        each.step, CYCLE, time, noisy(torques, 2e-3), noisy(read[0], 2e-6), noisy(read[1], 1e-5), each.period
    )


Records = tuple[Record, Record]


@pytest.fixture(scope="session")
def prototype() -> VehicleDescription:
    return load_vehicle("prototype")


@pytest.fixture(scope="session")
def drives(prototype: VehicleDescription) -> Callable[..., Records]:
    """A record to fit and one to confirm, of other motions and noise."""

    def make(periods: int = 3, *, bristles: tuple[int, float, float] | None = None, compliance: float = 0.0) -> Records:
        generator = np.random.default_rng(7)
        truth = Truth(bristles=LuGre(*bristles) if bristles else None, compliance=compliance)
        courses = [course(step, generator, periods) for _ in range(2) for step in STEPS]
        segments = drive(truth, prototype, courses, generator)
        return Record(segments[:4], "fit"), Record(segments[4:], "confirm")

    return make


@pytest.fixture(scope="session")
def plain_truth() -> Mapping[str, float]:
    return Truth().parameters


@pytest.fixture(scope="session", params=["prototype", "compact"])
def vehicle(request: pytest.FixtureRequest) -> VehicleDescription:
    """Both shipped vehicles: their a/r differ, one above and one below 1."""
    return load_vehicle(request.param)


@pytest.fixture(scope="session")
def geometry(vehicle: VehicleDescription) -> Geometry:
    return vehicle.geometry


CAMPAIGN = (
    Step.WHEEL_LIFTED,
    Step.STEERING_LEFT,
    Step.STEERING_RIGHT,
    Step.STRAIGHT,
    Step.ROTATION,
    Step.LANE_CHANGE,
)
CYCLE = 0.004
TORQUE_NOISE = 0.01


def some_excitation(step: Step, vehicle: VehicleDescription) -> Excitation:
    spec = EXCITATIONS[step]
    axis = axis_of(spec, vehicle)
    shape = resting_projection(spec.harmonics) @ np.random.default_rng(7).normal(size=2 * spec.harmonics)
    series = series_of(shape, spec.period)
    motion = series.evaluate(np.linspace(0.0, spec.period, 400))
    problem = Problem(spec, axis, vehicle.limits, vehicle.geometry.gear_ratio, vehicle.prior["m_ch"], Processing())
    factor, binding = size_within_limits(motion, problem)
    return Excitation(series.scaled(factor), 5.0, binding)


def integral(rate: Array, cycle: float) -> Array:
    steps = (rate[1:] + rate[:-1]) * cycle / 2
    return np.concatenate([np.zeros((1, rate.shape[1])), np.cumsum(steps, axis=0)])


def wheel_angles(reference: Reference, plan: Plan, alpha: Array) -> Array:
    if reference.step is Step.WHEEL_LIFTED:
        return np.stack([track.position for name, track in reference.tracks.items() if name.startswith("beta")], axis=1)
    mode = Mode.STEERED if reference.step is Step.LANE_CHANGE else EXCITATIONS[reference.step].mode
    assert mode is not None
    rates = {name: track.velocity for name, track in reference.tracks.items()}
    if mode is Mode.STEERED:
        rates["alpha_v"] = np.gradient(virtual_steering(alpha, plan.vehicle.geometry), reference.sample_time)
    velocity = np.stack([rates[name] for name in kinematics.GENERALIZED_VELOCITIES[mode]], axis=1)
    lifted, _ = dynamics.lift_velocities(mode, alpha, velocity, np.zeros_like(velocity), plan.vehicle.geometry)
    return integral(lifted[:, 5:], reference.sample_time)


def driven(plan: Plan, step: Step, truth: Parameters, start: float, generator: np.random.Generator) -> Segment:
    reference = plan.reference(step, truth)
    count = len(reference)
    alpha = np.zeros((count, 2))
    for side, name in enumerate(STEERING_LOOPS):
        if name in reference.tracks:
            alpha[:, side] = reference.tracks[name].position
    noise = TORQUE_NOISE * generator.normal(size=(count, 4))
    time = start + plan.cycle * np.arange(count)
    beta = wheel_angles(reference, plan, alpha)
    return make_segment(
        Segment(step, 0.0, time, reference.feed_forward + noise, beta, alpha, reference.period), "simulated"
    )


@pytest.fixture(scope="session")
def truth() -> Parameters:
    return load_paper_result().parameters


@pytest.fixture(scope="session")
def plan(prototype: VehicleDescription) -> Plan:
    excitations = {step: some_excitation(step, prototype) for step in CAMPAIGN if step in EXCITATIONS}
    return assemble_plan(prototype, excitations, steps=CAMPAIGN, periods=4, cycle=CYCLE)


@pytest.fixture(scope="session")
def record(plan: Plan, truth: Parameters) -> Record:
    generator = np.random.default_rng(3)
    segments, start = [], 10.0
    for step in plan.steps:
        segments.append(driven(plan, step, truth, start, generator))
        start = float(segments[-1].time[-1]) + 0.5
    return Record(segments, "simulated")


@pytest.fixture(scope="session")
def identification(record: Record, prototype: VehicleDescription) -> Identification:
    return identify(record, prototype.geometry)
