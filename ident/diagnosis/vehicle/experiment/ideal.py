"""Experiments without a vehicle: records that the plain model would make, to see what each could show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.campaign.dither import dither_torques
from ident.campaign.excitation import FourierSeries, resting_projection, series_of
from ident.campaign.steps import DIAGNOSTIC as DRIVEN
from ident.campaign.steps import EXCITATIONS, StepSpec
from ident.diagnosis.names import EffectName
from ident.effects import Effect, make_effect
from ident.plant import dynamics, kinematics
from ident.plant.modes import Mode
from ident.records.record import FOUR_STEPS, PAYLOAD, Record, Segment, Step, make_segment
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import GRAVITY

Array = NDArray[np.float64]

SAMPLE_TIME: Final = 0.004
PERIODS: Final = 2
TURN_TIME: Final = 6.0
"""Of half a turn on the spot [s]."""
INCLINED: Final = 0.0175
"""Slope [rad] on which friction still holds a vehicle without brakes."""
PAYLOAD_MASS: Final = 80.0
"""Of a known load [kg], a tenth of the vehicle; half as much leaves too little of a drive's gain."""


@dataclass(frozen=True)
class Drive:
    """One step of an experiment.

    Attributes:
        step: base step.
        variant: appended to its name, empty for the step itself; in the limits that a campaign drives it in.
        dither: whether the motors work against each other too.
        turned: whether the vehicle is turned by half a turn before.
        payload: mass of a known load [kg].
        slope: angle by which the floor rises ahead [rad]; for straight and rotation that begin at heading zero.
    """

    step: Step
    variant: str = ""
    dither: bool = False
    turned: bool = False
    payload: float = 0.0
    slope: float = 0.0

    @property
    def name(self) -> str:
        """In records."""
        return f"{self.step}_{self.variant}" if self.variant else str(self.step)

    @property
    def spec(self) -> StepSpec:
        """Its limits."""
        return DRIVEN.get(self.name, EXCITATIONS[self.step])


@dataclass(frozen=True)
class Experiment:
    """Steps that are driven beside the four of the campaign.

    Attributes:
        advice: to a person who is to drive it.
        drives: its steps.
        given: effects that are there and known while it is driven.
    """

    advice: str
    drives: tuple[Drive, ...]
    given: tuple[Effect, ...] = ()


FOUR: Final = tuple(Drive(step) for step in FOUR_STEPS)

DIAGNOSTIC: Final[Mapping[str, Experiment]] = MappingProxyType(
    {
        "two headings": Experiment(
            "drive straight a second time after half a turn on the spot",
            (Drive(Step.STRAIGHT, "turned", turned=True),),
        ),
        "torque dither": Experiment(
            "drive straight with torque dither, the motors working against each other",
            (Drive(Step.STRAIGHT, "dither", dither=True),),
        ),
        "wheels lifted": Experiment("drive wheel_lifted on a jack-stand", (Drive(Step.WHEEL_LIFTED),)),
        "lateral": Experiment("drive lateral", (Drive(Step.LATERAL),)),
        "several speeds": Experiment(
            "drive steering_left, steering_right and straight slowly too",
            tuple(Drive(step, "slow") for step in (Step.STEERING_LEFT, Step.STEERING_RIGHT, Step.STRAIGHT)),
        ),
        "on a slope": Experiment(
            "drive straight and rotation on a floor inclined by one degree, with that slope in the model (--model)",
            (Drive(Step.STRAIGHT, slope=INCLINED), Drive(Step.ROTATION, slope=INCLINED)),
            (make_effect(EffectName.SLOPE, "chassis", {"angle": INCLINED}),),
        ),
        "known payload": Experiment(
            "drive straight and rotation with a load of known mass, a tenth of the vehicle or more (--payload)",
            tuple(Drive(step, "loaded", payload=PAYLOAD_MASS) for step in (Step.STRAIGHT, Step.ROTATION)),
        ),
    }
)
"""Experiments by name, the easiest first."""


def ideal_record(
    drives: Sequence[Drive], vehicle: VehicleDescription, seed: int = 1, *, periods: int = PERIODS
) -> Record:
    """A record without noise of the plain model with the vehicle file's parameters; random excitation by `seed`."""
    generator = np.random.default_rng(seed)
    segments: list[Segment] = []
    for drive in drives:
        if drive.turned:
            segments.append(_turn(vehicle))
        segments.append(_segment(drive, vehicle, generator, periods))
    return Record(segments, "ideal")


def _segment(drive: Drive, vehicle: VehicleDescription, generator: np.random.Generator, periods: int) -> Segment:
    spec = drive.spec
    series = _series(spec, generator)
    per_period = round(spec.period / SAMPLE_TIME)
    time = np.linspace(0.0, periods * spec.period, periods * per_period, endpoint=False)
    motion = series.evaluate(time)
    alpha, beta, torques = (
        _lifted(motion, vehicle) if spec.mode is None else _on_the_floor(spec, spec.mode, motion, vehicle, drive)
    )
    if drive.dither:
        torques = torques + dither_torques(time, spec.period, vehicle)
    period = np.repeat(np.arange(periods), per_period)
    extra = {PAYLOAD: np.full(len(time), drive.payload)} if drive.payload else {}
    return make_segment(Segment(drive.name, 0.0, time, torques, beta, alpha, period, extra=extra), "ideal")


def _series(spec: StepSpec, generator: np.random.Generator) -> FourierSeries:
    series = series_of(resting_projection(spec.harmonics) @ generator.normal(size=2 * spec.harmonics), spec.period)
    position, velocity, acceleration = series.evaluate(np.linspace(0, spec.period, 400))
    limits = zip((spec.stroke, spec.speed, spec.acceleration), (position, velocity, acceleration), strict=True)
    return series.scaled(0.9 * min(limit / float(np.abs(values).max()) for limit, values in limits))


def _lifted(motion: tuple[Array, Array, Array], vehicle: VehicleDescription) -> tuple[Array, Array, Array]:
    position, velocity, acceleration = motion
    rates, accelerations = np.zeros((2, len(position), 9))
    rates[:, 5:], accelerations[:, 5:] = velocity[:, None], acceleration[:, None]
    torques = (dynamics.regressor(rates, accelerations) @ vehicle.prior.values)[:, 5:] / vehicle.geometry.gear_ratio
    return np.zeros((len(position), 2)), np.tile(position[:, None], 4), torques


def _on_the_floor(
    spec: StepSpec, mode: Mode, motion: tuple[Array, Array, Array], vehicle: VehicleDescription, drive: Drive
) -> tuple[Array, Array, Array]:
    """Angles by the constant column of H_k that these steps drive, torques by (21)."""
    position, velocity, acceleration = motion
    names = kinematics.GENERALIZED_VELOCITIES[mode]
    row = names.index(spec.coordinate)
    alpha = np.tile(spec.steering(vehicle.geometry), (len(position), 1))
    column = kinematics.complement(mode, alpha[:1], vehicle.geometry)[0, 5:, row]
    velocities, accelerations = np.zeros((2, len(position), len(names)))
    velocities[:, row], accelerations[:, row] = velocity, acceleration
    if mode is Mode.ALIGNMENT:
        alpha[:, row] += position
    loaded = vehicle.prior.values + drive.payload * (np.array(PARAMETER_NAMES) == "m_ch")
    torques = dynamics.feed_forward(mode, alpha, velocities, accelerations, loaded, vehicle.geometry)
    if drive.slope and "x" in names:
        weight = (vehicle.prior["m_ch"] + drive.payload) * GRAVITY * np.sin(drive.slope)
        driven = dynamics.projected_input(mode, alpha[:1], vehicle.geometry)[0]
        torques = torques + np.linalg.pinv(driven)[:, names.index("x")] * weight
    return alpha, position[:, None] * column, torques


def _turn(vehicle: VehicleDescription) -> Segment:
    """Half a turn on the spot; a step that no row is made of."""
    time = np.linspace(0.0, TURN_TIME, round(TURN_TIME / SAMPLE_TIME), endpoint=False)
    share = time / TURN_TIME
    angle = np.pi * (share - np.sin(2 * np.pi * share) / (2 * np.pi))
    spec = EXCITATIONS[Step.ROTATION]
    alpha = np.tile(spec.steering(vehicle.geometry), (len(time), 1))
    column = kinematics.complement(Mode.ROTATION, alpha[:1], vehicle.geometry)[0, 5:, 0]
    period = np.full(len(time), -1)
    return make_segment(
        Segment("turn", 0.0, time, np.zeros((len(time), 4)), angle[:, None] * column, alpha, period), ""
    )
