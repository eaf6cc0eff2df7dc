"""A prototype for a vehicle of which only the vehicle file and the wiring are known: what rehearsals are driven on.

Its truth is the prior of the vehicle file, its lengths, motors and wiring are those of the files. The rest of a
prototype file is derived here, each number with the rule that it comes from as its source; all of it is assumed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from emulator.prototype import SIDES, TABLE_UNITS, Prototype, build_prototype
from emulator.rigid_bodies import WHEEL_TRANSVERSE_RATIO
from ident.errors import DataFileError
from ident.vehicle.description import VehicleDescription
from ident.vehicle.geometry import WHEELS
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import GRAVITY, Quantity

MASS_SHARE: Final = 0.0025
"""Mass of a wheel over that of the vehicle, where the steering inertia leaves room for it [-]."""

KNUCKLE_SHARE: Final = 2.0
"""Mass of a knuckle over that of its wheel [-]: bearing housing, motor and gear."""

UNIT_SHARE: Final = 0.5
"""Share of what the wheel's own inertia leaves of C_l or C_r that the masses off the steering axis may take [-]."""

TYRE_DEFLECTION: Final = 0.2e-3
"""Of a tyre under a quarter of the weight [m]: solid polyurethane."""

GRIP_RATIO: Final = 1.4
"""Friction of the emulated floor over limits.floor_friction, which is the low end that a campaign counts on [-]."""

REFERENCE_TORQUE: Final = 1.27
"""Rated torque of the servo whose data sheet the electrical numbers are scaled from [Nm]; 400 W, 60 mm flange."""


@dataclass(frozen=True)
class Wiring:
    """What a network file says of drives and encoders, as the hardware below the firmware needs it.

    Attributes:
        drive_counts: motor increments per turn of the shaft.
        drive_directions: +1 or -1 per wheel (fl, rl, fr, rr).
        encoder_counts: increments of a steering encoder per turn.
        encoder_zeros: reading with the wheels straight per side (left, right), increments.
        encoder_directions: +1 or -1 per side.
        cycle_period: of the bus [s].
    """

    drive_counts: int
    drive_directions: tuple[int, ...]
    encoder_counts: int
    encoder_zeros: tuple[int, ...]
    encoder_directions: tuple[int, ...]
    cycle_period: float


_SWEEPS: Final = 200
"""Of the engine's solver for a vehicle that nobody has tried: with 50 the wheels of one that was drawn rolled 1.7 to
3.2 % too far in steering, with 200 it is 0.05 %."""


@dataclass(frozen=True)
class DerivedPrototype:
    """A prototype, and what of it no file says.

    Attributes:
        prototype: ready for the emulator.
        assumed: table -> entry -> the number, its source telling the rule.
    """

    prototype: Prototype
    assumed: Mapping[str, Mapping[str, Quantity]]

    def lines(self) -> Iterator[str]:
        """One line for each number that is assumed."""
        for table, entries in self.assumed.items():
            for name, quantity in entries.items():
                unit = "" if quantity.unit == "1" else f" {quantity.unit}"
                yield f"{table}.{name} = {quantity.value:.4g}{unit}: {quantity.source}"


def derive_prototype(vehicle: VehicleDescription, wiring: Wiring) -> DerivedPrototype:
    """A prototype whose truth is the prior of a vehicle file.

    Raises:
        DataFileError: no body can have the inertias of the prior, or an entry of it is zero.
    """
    path = vehicle.path or Path(vehicle.name)
    for name in PARAMETER_NAMES:
        if not vehicle.prior[name] > 0:
            raise DataFileError(
                f"{path}: the emulator needs [prior] {name} above zero, as every vehicle has it.",
                "Put in a small guess to rehearse; to drive, zero will do.",
            )
    assumed = {
        **_mechanics(vehicle),
        **_electrics(vehicle, wiring),
        "noise": {
            "torque_sensor": _of("1", 0.005, "rms of rated torque, current sensor and 12-bit converter"),
            "encoder_dither": _of("1", 0.5, "rms in increments, interpolation noise of the encoders"),
            "load_fluctuation": _of("1", 0.02, "rms of the joint's Coulomb torque; gear mesh, bearing, floor"),
            "load_correlation_time": _of("s", 0.1, "one gear-stage revolution at walking speed"),
        },
    }
    stated = _stated(vehicle, wiring)
    tables = {
        name: {
            **{key: quantity.value for key, quantity in assumed.get(name, {}).items()},
            **stated.get(name, {}),
        }
        for name in TABLE_UNITS
    }
    built = build_prototype(vehicle.name, vehicle.geometry, vehicle.prior, tables, path)
    encoder = replace(built.encoder, zero_positions=wiring.encoder_zeros)
    return DerivedPrototype(replace(built, encoder=encoder, solver_sweeps=_SWEEPS), assumed)


def _stated(vehicle: VehicleDescription, wiring: Wiring) -> dict[str, dict[str, float]]:
    """The entries that the files say."""
    return {
        "drive": {
            "rated_torque": vehicle.limits.rated_torque,
            "peak_torque": vehicle.limits.peak_torque,
            "counts_per_revolution": float(wiring.drive_counts),
            "interpolation_time": wiring.cycle_period,
            **_directions(WHEELS, wiring.drive_directions),
        },
        "steering_encoder": {
            "counts_per_revolution": float(wiring.encoder_counts),
            "zero_position": 0.0,
            **_directions(SIDES, wiring.encoder_directions),
        },
    }


def _directions(names: tuple[str, ...], directions: tuple[int, ...]) -> dict[str, float]:
    return {f"direction_{name}": float(value) for name, value in zip(names, directions, strict=True)}


def _of(unit: str, value: float, rule: str) -> Quantity:
    return Quantity(value, unit, f"assumed: {rule}")


def _mechanics(vehicle: VehicleDescription) -> dict[str, dict[str, Quantity]]:
    prior, geometry, limits = vehicle.prior, vehicle.geometry, vehicle.limits
    mass = prior["m_ch"]
    wheel = _wheel_mass(vehicle)
    length, width = _body(vehicle, 4 * wheel * (1 + KNUCKLE_SHARE))
    clearance = 2 * geometry.wheel_radius
    return {
        "units": {
            "wheel_mass": _of("kg", wheel, f"{MASS_SHARE:.2%} of m_ch, or what C_l and C_r leave room for"),
            "knuckle_mass": _of("kg", KNUCKLE_SHARE * wheel, f"{KNUCKLE_SHARE:g} times the wheel's"),
        },
        "body": {
            "length": _of("m", length, "uniform body with the C_ch of [prior], as long to wide as wheelbase to track"),
            "width": _of("m", width, "see length"),
            "height": _of("m", clearance, "twice the wheel radius: flat load carrier"),
            "centre_height": _of("m", clearance, "twice the wheel radius"),
        },
        "floor": {
            "friction": _of("1", GRIP_RATIO * limits.floor_friction, f"{GRIP_RATIO:g} times limits.floor_friction"),
        },
        "tyre": {
            "stiffness": _of("N/m", mass * GRAVITY / 4 / TYRE_DEFLECTION, "0.2 mm under a quarter of the weight"),
            "damping_ratio": _of("1", 1.0, "heave of the vehicle dies out without a bounce"),
        },
    }


def _wheel_mass(vehicle: VehicleDescription) -> float:
    """Mass of a wheel that leaves the knuckles of both sides an inertia [kg]."""
    prior, offset = vehicle.prior, vehicle.geometry.wheel_offset
    left = min(prior["C_l"], prior["C_r"]) / 2 - WHEEL_TRANSVERSE_RATIO * prior["B_w"]
    if left <= 0:
        raise DataFileError(
            f"{vehicle.path or vehicle.name}: [prior] C_l = {prior['C_l']:g} and C_r = {prior['C_r']:g} kg m^2 are too "
            f"small beside B_w = {prior['B_w']:g} kg m^2 for the emulator: two wheels that spin with B_w turn about "
            f"their steering axes with {2 * WHEEL_TRANSVERSE_RATIO * prior['B_w']:.3g} kg m^2 alone.",
            "Check the three priors; such a vehicle can be driven and identified, but not rehearsed.",
        )
    # Wheel and counterweight: m a^2 + (m/k) a^2 with k the share of the knuckle.
    return min(MASS_SHARE * prior["m_ch"], UNIT_SHARE * left / (offset**2 * (1 + 1 / KNUCKLE_SHARE)))


def _body(vehicle: VehicleDescription, units_mass: float) -> tuple[float, float]:
    """Length and width of a uniform body with what the units leave of mass and yaw inertia [m]."""
    prior, geometry = vehicle.prior, vehicle.geometry
    diagonal_squared = geometry.wheelbase**2 + geometry.track_width**2
    inertia = prior["C_ch"] - units_mass * diagonal_squared / 4
    if inertia <= 0:
        raise DataFileError(
            f"{vehicle.path or vehicle.name}: [prior] C_ch = {prior['C_ch']:g} kg m^2 is less than that of the "
            f"steering units alone, which stand at the corners of the wheelbase and the track width.",
            "Correct C_ch or m_ch of [prior].",
        )
    scale = (12 * inertia / (prior["m_ch"] - units_mass) / diagonal_squared) ** 0.5
    return scale * geometry.wheelbase, scale * geometry.track_width


def _electrics(vehicle: VehicleDescription, wiring: Wiring) -> dict[str, dict[str, Quantity]]:
    limits = vehicle.limits
    size = limits.rated_torque / REFERENCE_TORQUE
    current = 2.6 * size
    return {
        "drive": {
            "rated_current": _of("A", current, "2.05 A/Nm, as a 400 W servo for 200 V has"),
            "peak_current": _of("A", current * limits.peak_torque / limits.rated_torque, "in proportion to torque"),
            "current_loop_bandwidth": _of("rad/s", 6283.2, "1 kHz, usual for a servo with 8-16 kHz switching"),
        },
        "power_stage": {
            "supply_voltage": _of("V", 282.0, "rectified 200 V AC"),
            "link_capacitance": _of("F", 6.8e-4 * size, "some 20 J for 400 W, in proportion to rated torque"),
            "chopper_voltage": _of("V", 380.0, "brake chopper of 200 V AC servo amplifiers"),
            "chopper_power": _of("W", limits.peak_torque * limits.motor_speed, "peak torque at full speed"),
            "over_voltage": _of("V", 410.0, "over-voltage alarm of 200 V AC servo amplifiers"),
            "phase_resistance": _of("Ohm", 1.5 / size, "30 W of copper loss for 400 W, in proportion to torque"),
            "peak_time": _of("s", 1.0, "peak current of servo amplifiers is usually given for one second"),
            "overload_time": _of("s", 3.0, "about 3 s at peak torque"),
            "stall_time": _of("s", 2.0, "longer than the steering takes to break away"),
        },
    }
