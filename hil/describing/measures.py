"""What has to be measured or looked up of a vehicle, and what such a vehicle can be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from hil.describing.guesses import guess_priors
from ident.errors import DataFileError
from ident.vehicle.geometry import Geometry


@dataclass(frozen=True)
class Measure:
    """A number that is asked for.

    Attributes:
        unit: SI, "1" for none.
        low, high: what a vehicle of this kind has.
        meaning: for people.
    """

    unit: str
    low: float
    high: float
    meaning: str


ASKED: Final[Mapping[str, Measure]] = {
    "wheelbase": Measure("m", 0.4, 4.0, "between front and rear steering axes"),
    "track_width": Measure("m", 0.3, 3.0, "between left and right steering axes"),
    "wheel_offset": Measure("m", 0.02, 0.5, "from steering axis to wheel contact, along the axle"),
    "wheel_radius": Measure("m", 0.03, 0.4, "of the loaded wheel"),
    "gear_ratio": Measure("1", 3.0, 100.0, "motor turns per wheel turn"),
    "mass": Measure("kg", 50.0, 5000.0, "of the whole vehicle, steering units included"),
    "rated_torque": Measure("Nm", 0.1, 50.0, "of a motor, at its shaft (object 6076h)"),
}
"""What nobody can guess: measured, weighed, or read from the plate of the motor."""

DEFAULTS: Final[Mapping[str, Measure]] = {
    "peak_torque": Measure("Nm", 0.1, 150.0, "of a motor; default: three times the rated torque"),
    "motor_speed": Measure("rad/s", 20.0, 2000.0, "of a motor; default: 314 rad/s, 3000 rpm"),
    "steering_limit": Measure("rad", 0.5, math.pi, "mechanical stop of the steering; default: 1.62 rad"),
    "floor_friction": Measure("1", 0.1, 1.2, "adhesion between wheel and floor; default: 0.6"),
    "floor_length": Measure("m", 1.0, 200.0, "free floor along the vehicle; default: what a campaign needs"),
    "floor_width": Measure("m", 1.0, 200.0, "free floor across the vehicle; default: what a campaign needs"),
}
"""What is assumed where it is not given."""

PEAK_RATIO: Final = 3.0
MOTOR_SPEED: Final = 314.0
STEERING_LIMIT: Final = 1.62
FLOOR_FRICTION: Final = 0.6

CAMPAIGN_LENGTH: Final = 8.5
CAMPAIGN_WIDTH: Final = 2.0
"""Floor that a campaign needs beyond the circle that the wheels sweep [m]: lane change, strokes, some reserve."""

MOST_FRICTION: Final = 0.7
"""Share of the rated torque that friction may take [-]: the rest moves the vehicle, and inertia is seen by that."""

LEAST_SPEED: Final = 0.5
"""Speed that the motors must reach [m/s]."""

LEVER_RATIOS: Final = (0.4, 2.0)
"""a/r at which wheels that roll steer well."""

MOST_ROTOR: Final = 0.3
"""Share of the mass that the spinning parts may add to it: beyond, B_w blurs m_ch."""


@dataclass(frozen=True)
class Measures:
    """The numbers that a description is written from, SI; see ASKED and DEFAULTS."""

    wheelbase: float
    track_width: float
    wheel_offset: float
    wheel_radius: float
    gear_ratio: float
    mass: float
    rated_torque: float
    peak_torque: float
    motor_speed: float
    steering_limit: float
    floor_friction: float
    floor_length: float
    floor_width: float
    assumed: frozenset[str] = frozenset()

    @property
    def geometry(self) -> Geometry:
        """The lengths."""
        return Geometry(
            self.wheelbase,
            self.track_width,
            self.wheel_offset,
            self.wheel_radius,
            self.gear_ratio,
            self.steering_limit,
        )


def check_measures(given: Mapping[str, float]) -> Measures:
    """Measures from what is given, the rest assumed.

    Args:
        given: all of ASKED, and any of DEFAULTS.

    Raises:
        DataFileError: a number is missing, is outside of what such vehicles have, or the motors are too weak.
    """
    missing = [name for name in ASKED if name not in given]
    if missing:
        options = " ".join(option_of(name) for name in missing)
        raise DataFileError(
            f"{', '.join(missing)} of the vehicle {'is' if len(missing) == 1 else 'are'} not given.",
            f"Give {options}, or run this on a terminal to be asked.",
        )
    for name, value in given.items():
        _check_range(name, value)
    measures = Measures(**_assumed(given), **given, assumed=frozenset(set(DEFAULTS) - set(given)))
    _check_motors(measures)
    return measures


def option_of(name: str) -> str:
    """The option of the command line that gives a number."""
    return f"--{name.replace('_', '-')}"


def _check_range(name: str, value: float) -> None:
    measure = ASKED.get(name) or DEFAULTS[name]
    if not measure.low <= value <= measure.high:
        unit = "" if measure.unit == "1" else f" {measure.unit}"
        raise DataFileError(
            f"{option_of(name)} {value:g} is not within {measure.low:g} to {measure.high:.4g}{unit}.",
            f"It is {measure.meaning}, in SI units.",
        )


def _assumed(given: Mapping[str, float]) -> dict[str, float]:
    lengths = {name: given[name] for name in ("wheelbase", "track_width", "wheel_offset", "wheel_radius", "gear_ratio")}
    geometry = Geometry(**lengths)
    swept = geometry.footprint[0]
    defaults = {
        "peak_torque": PEAK_RATIO * given["rated_torque"],
        "motor_speed": MOTOR_SPEED,
        "steering_limit": STEERING_LIMIT,
        "floor_friction": FLOOR_FRICTION,
        "floor_length": math.ceil(2 * (CAMPAIGN_LENGTH + swept)) / 2,
        "floor_width": math.ceil(2 * (CAMPAIGN_WIDTH + swept)) / 2,
    }
    return {name: value for name, value in defaults.items() if name not in given}


@dataclass(frozen=True)
class _Share:
    """How much of something is used: `what` names it, `used` may be at most `most`."""

    what: str
    used: float
    most: float
    remedy: str


def _check_motors(measures: Measures) -> None:
    """See that the motors fit the vehicle, by the priors that are guessed.

    Raises:
        DataFileError: with what falls short.
    """
    lever = measures.geometry.lever_ratio
    if not LEVER_RATIOS[0] <= lever <= LEVER_RATIOS[1]:
        raise DataFileError(
            f"wheel_offset over wheel_radius is {lever:.2f}, not within {LEVER_RATIOS[0]} to {LEVER_RATIOS[1]}.",
            "Check both: the wheels steer by rolling around their steering axes.",
        )
    for share in _shares(measures):
        if share.used > share.most:
            raise DataFileError(f"{share.what}: {share.used:.0%}, at most {share.most:.0%} work.", share.remedy)


def _shares(measures: Measures) -> tuple[_Share, ...]:
    prior = guess_priors(measures.geometry, measures.mass, measures.rated_torque)
    at_wheel = measures.gear_ratio * measures.rated_torque
    steering = 2 * measures.geometry.lever_ratio * at_wheel
    speed = measures.motor_speed * measures.wheel_radius / measures.gear_ratio
    return (
        _Share(
            "Rolling friction, as guessed, takes too much of the rated torque",
            prior["d_cw"].value / at_wheel,
            MOST_FRICTION,
            "Check mass, wheel_radius, gear_ratio and rated_torque: these motors hardly move the vehicle.",
        ),
        _Share(
            "Steering friction, as guessed, takes too much of the rated torque",
            prior["d_cl"].value / steering,
            MOST_FRICTION,
            "Check mass, wheel_offset, gear_ratio and rated_torque: these motors hardly steer the vehicle.",
        ),
        _Share(
            f"{LEAST_SPEED} m/s, which a campaign drives, are too much for motors that reach {speed:.2f} m/s",
            LEAST_SPEED / speed,
            1.0,
            "Check motor_speed, gear_ratio and wheel_radius.",
        ),
        _Share(
            "Motors and gears of this size add too much to the mass",
            4 * prior["B_w"].value / measures.wheel_radius**2 / measures.mass,
            MOST_ROTOR,
            "Check rated_torque, gear_ratio, wheel_radius and mass: the motors are too large for the vehicle.",
        ),
    )
