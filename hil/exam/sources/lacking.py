"""Effects of the library, and laws without a name, in the independent vehicle: written from docs/effects.md alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from hil.exam.sources.independent import Resisting, Truth
from hil.exam.sources.recording import Cogging, Flaws
from ident.effects import Effect
from ident.errors import UserError

Array = NDArray[np.float64]

_WHEELS: Final = ("fl", "rl", "fr", "rr")
_FRICTION: Final = (("d_vl", "d_cl"), ("d_vr", "d_cr"), *[("d_vw", "d_cw")] * 4)
"""Viscous and dry friction of the joints in rows 3 to 8 of q."""


@dataclass(frozen=True)
class Built:
    """A vehicle and its drives and encoders."""

    truth: Truth = field(default_factory=Truth)
    flaws: Flaws = field(default_factory=Flaws)

    def having(self, effects: list[Effect]) -> Built:
        """The same with effects.

        Raises:
            UserError: it cannot have one of them.
        """
        built = self
        for effect in effects:
            if effect.name not in _MADE or (effect.name, effect.where) in _NOT_THERE:
                raise UserError(f"The independent vehicle has no {effect}.", f"It has {', '.join(_MADE)}.")
            built = _MADE[effect.name](built, effect)
        return built

    def resisting(self, law: Resisting) -> Built:
        """With one more torque that resists."""
        return replace(self, truth=replace(self.truth, resists=_both(self.truth.resists, law)))

    def drier(self, law: Resisting) -> Built:
        """With more dry friction."""
        return replace(self, truth=replace(self.truth, dry=_both(self.truth.dry, law)))


def can_have(name: str, where: str) -> bool:
    """Whether the independent vehicle can have an effect at a place."""
    return name in _MADE and (name, where) not in _NOT_THERE


def _both(one: Resisting | None, other: Resisting) -> Resisting:
    if one is None:
        return other
    return lambda alpha, beta, rates, time: one(alpha, beta, rates, time) + other(alpha, beta, rates, time)


def _rows(where: str) -> list[int]:
    """Rows of q of the joints at a place."""
    if where in ("steering", "wheels"):
        return [3, 4] if where == "steering" else [5, 6, 7, 8]
    kind, _, which = where.partition("_")
    return [3 + ("left", "right").index(which)] if kind == "steering" else [5 + _WHEELS.index(which)]


def _wheels(where: str) -> list[int]:
    """Numbers of the drives or wheels at a place."""
    return [0, 1, 2, 3] if where in ("drives", "wheels", "chassis") else [_WHEELS.index(where.partition("_")[2])]


def _sides(where: str) -> list[int]:
    return [0, 1] if where in ("encoders", "steering") else [("left", "right").index(where.partition("_")[2])]


def _at(where: str, law: Callable[[Array], Array]) -> Resisting:
    """A torque of a joint's rate, at every joint of a place."""
    rows = _rows(where)

    def resisting(_alpha: Array, _beta: Array, rates: Array, _time: float) -> Array:
        torques = np.zeros_like(rates)
        torques[:, rows] = law(rates[:, rows])
        return torques

    return resisting


def _added(values: tuple[float, ...], numbers: list[int], more: float) -> tuple[float, ...]:
    return tuple(value + more * (number in numbers) for number, value in enumerate(values))


def _stribeck(built: Built, effect: Effect) -> Built:
    amplitude, velocity = effect["amplitude"], effect["velocity"]
    return built.drier(_at(effect.where, lambda rate: amplitude * np.exp(-((rate / velocity) ** 2))))


def _asymmetric_coulomb(built: Built, effect: Effect) -> Built:
    return built.resisting(_at(effect.where, lambda rate: np.full_like(rate, effect["imbalance"])))


def _asymmetric_viscous(built: Built, effect: Effect) -> Built:
    return built.resisting(_at(effect.where, lambda rate: effect["imbalance"] * np.abs(rate)))


def _quadratic_drag(built: Built, effect: Effect) -> Built:
    coefficient = effect["coefficient"]
    if effect.where != "chassis":
        return built.resisting(_at(effect.where, lambda rate: coefficient * rate * np.abs(rate)))

    def drag(_alpha: Array, _beta: Array, rates: Array, _time: float) -> Array:
        force = np.zeros_like(rates)
        force[:, :2] = coefficient * np.hypot(rates[:, 0], rates[:, 1])[:, None] * rates[:, :2]
        return force

    return built.resisting(drag)


def _friction_position(built: Built, effect: Effect) -> Built:
    rows = _rows(effect.where)

    def more(alpha: Array, _beta: Array, rates: Array, _time: float) -> Array:
        torques = np.zeros_like(rates)
        for row in rows:
            torques[:, row] = effect["slope"] * alpha[:, row - 3]
        return torques

    return built.drier(more)


def _friction_warming(built: Built, effect: Effect) -> Built:
    rows, parameters = _rows(effect.where), built.truth.parameters
    viscous, dry = np.array([[parameters[name] for name in _FRICTION[row - 3]] for row in rows]).T

    def share(time: float) -> float:
        return float(effect["change"] * (1 - np.exp(-time / effect["time"])))

    def more(_alpha: Array, _beta: Array, rates: Array, time: float) -> Array:
        torques = np.zeros_like(rates)
        torques[:, rows] = share(time) * dry
        return torques

    def resisting(_alpha: Array, _beta: Array, rates: Array, time: float) -> Array:
        torques = np.zeros_like(rates)
        torques[:, rows] = share(time) * viscous * rates[:, rows]
        return torques

    return built.drier(more).resisting(resisting)


def _slope(built: Built, effect: Effect) -> Built:
    return replace(built, truth=replace(built.truth, slope=effect["angle"], uphill=effect["direction"]))


def _payload(built: Built, effect: Effect) -> Built:
    parameters = dict(built.truth.parameters)
    parameters["m_ch"] += effect["mass"]
    parameters["C_ch"] += effect["inertia"]
    return replace(built, truth=replace(built.truth, parameters=parameters))


def _parameter_change(built: Built, effect: Effect) -> Built:
    parameters = dict(built.truth.parameters)
    parameters[effect.where] *= 1 + effect["change"]
    return replace(built, truth=replace(built.truth, parameters=parameters))


def _elasticity(built: Built, effect: Effect) -> Built:
    (wheel,) = _wheels(effect.where)
    return replace(built, truth=replace(built.truth, compliance=effect["compliance"], soft=wheel))


def _wheel_radius(built: Built, effect: Effect) -> Built:
    larger = _added(built.truth.larger, _wheels(effect.where), effect["error"])
    return replace(built, truth=replace(built.truth, larger=larger))


def _wheel_eccentricity(built: Built, effect: Effect) -> Built:
    wheels, truth = _wheels(effect.where), built.truth
    off = _added(truth.off_centre, wheels, effect["amplitude"])
    return replace(built, truth=replace(truth, off_centre=off, phase=_added(truth.phase, wheels, effect["phase"])))


def _scrub(built: Built, effect: Effect) -> Built:
    wheels = {"steering_left": [0, 1], "steering_right": [2, 3]}.get(effect.where, [0, 1, 2, 3])
    patch = _added(built.truth.patch, wheels, effect["torque"] / len(wheels))
    return replace(built, truth=replace(built.truth, patch=patch))


def _torque_gain(built: Built, effect: Effect) -> Built:
    gain = _added(built.flaws.gain, _wheels(effect.where), effect["error"])
    return replace(built, flaws=replace(built.flaws, gain=gain))


def _torque_bias(built: Built, effect: Effect) -> Built:
    bias = _added(built.flaws.bias, _wheels(effect.where), effect["bias"])
    return replace(built, flaws=replace(built.flaws, bias=bias))


def _torque_ripple(built: Built, effect: Effect) -> Built:
    numbers = (effect["amplitude"], effect["order"], effect["phase"])
    cogging = (Cogging(wheel, *numbers) for wheel in _wheels(effect.where))
    return replace(built, flaws=replace(built.flaws, cogging=(*built.flaws.cogging, *cogging)))


def _time_delay(built: Built, effect: Effect) -> Built:
    flaws, delay = built.flaws, effect["delay"]
    if effect.where.startswith("encoder"):
        left, right = _added(flaws.stale, _sides(effect.where), delay)
        return replace(built, flaws=replace(flaws, stale=(left, right)))
    return replace(built, flaws=replace(flaws, late=_added(flaws.late, _wheels(effect.where), delay)))


def _torque_filter(built: Built, effect: Effect) -> Built:
    flaws = built.flaws
    return replace(built, flaws=replace(flaws, slow=_added(flaws.slow, _wheels(effect.where), effect["time"])))


def _friction_load(built: Built, effect: Effect) -> Built:
    loss = _added(built.truth.loss, _wheels(effect.where), effect["share"])
    return replace(built, truth=replace(built.truth, loss=loss))


def _presliding(built: Built, effect: Effect) -> Built:
    bristles = ((row, effect["amplitude"], effect["angle"]) for row in _rows(effect.where))
    return replace(built, truth=replace(built.truth, dahl=(*built.truth.dahl, *bristles)))


def _steering_offset(built: Built, effect: Effect) -> Built:
    left, right = _added(built.flaws.offset, _sides(effect.where), effect["offset"])
    return replace(built, flaws=replace(built.flaws, offset=(left, right)))


def _law(built: Built, effect: Effect) -> Built:
    """B-splines of scipy over the knots that the effect states; constant beyond its range."""
    curve, rows = _curve(effect), _rows(effect.where)
    over_rate, holds = effect.name == "law_rate", effect.name.endswith("_direction")
    times_rate = effect.name.endswith("_rate") and not over_rate

    def law(alpha: Array, beta: Array, rates: Array, _time: float) -> Array:
        angles = np.concatenate([alpha, beta], axis=1)
        torques = np.zeros_like(rates)
        for row in rows:
            value = curve(rates[:, row] if over_rate else angles[:, row - 3])
            torques[:, row] = value * rates[:, row] if times_rate else value
        return torques

    return built.drier(law) if holds else built.resisting(law)


def _curve(effect: Effect) -> Callable[[Array], Array]:
    numbers = effect.parameters
    coefficients = effect["scale"] * np.array([effect[name] for name in sorted(numbers) if name.startswith("c_")])
    start, step, period = effect["start"], effect["step"], effect["period"]
    if period:
        around = np.concatenate([coefficients[-2:], coefficients, coefficients[:2]])
        knots = start + step * np.arange(-4, len(coefficients) + 4)
        spline = BSpline(knots, around, 3)
        return lambda x: np.asarray(spline(start + np.mod(x - start, period)))
    knots = start + step * np.arange(-2, len(coefficients) + 2)
    spline = BSpline(knots, coefficients, 3)
    low, high = start + step, start + (len(coefficients) - 2) * step
    return lambda x: np.asarray(spline(np.clip(x, low, high)))


_MADE: Final[Mapping[str, Callable[[Built, Effect], Built]]] = MappingProxyType(
    {
        "stribeck": _stribeck,
        "asymmetric_coulomb": _asymmetric_coulomb,
        "asymmetric_viscous": _asymmetric_viscous,
        "quadratic_drag": _quadratic_drag,
        "slope": _slope,
        "payload": _payload,
        "torque_gain": _torque_gain,
        "torque_bias": _torque_bias,
        "torque_ripple": _torque_ripple,
        "time_delay": _time_delay,
        "elasticity": _elasticity,
        "wheel_radius": _wheel_radius,
        "wheel_eccentricity": _wheel_eccentricity,
        "steering_offset": _steering_offset,
        "scrub": _scrub,
        "parameter_change": _parameter_change,
        "friction_warming": _friction_warming,
        "friction_position": _friction_position,
        "friction_load": _friction_load,
        "presliding": _presliding,
        "torque_filter": _torque_filter,
    }
    | dict.fromkeys(("law_rate", "law_angle", "law_angle_direction", "law_angle_rate"), _law)
)

_NOT_THERE: Final = frozenset(("elasticity", f"steering_{side}") for side in ("left", "right"))
"""Front and rear unit of a side are one body."""
