"""From the record of a master's death to times and distances, beside what option codes and ramp predict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from hil.master.drive_states import decode_state
from hil.network import DRIVES, Network
from hil.network.cia import DriveState
from hil.safety.trial import StopRecord, StopSettings

_SPEED_WINDOW: Final = 0.06
"""Time before the reaction from which the speed is taken [s]."""

_REMAINDER: Final = 5e-5
"""Way that is left when the vehicle counts as standing [m]; 14 mm/s and 7 ms at 2 m/s^2."""

_TOLERANCE: Final = 0.05
"""How far time and distance may be from the prediction [-]."""

_DETECTION_TOLERANCE: Final = 0.005
"""The same for the loss of the heartbeat [s]: two cycles, and the frames in front."""

_QUICK_STOP_RAMPS: Final = (2, 6)
_NO_REACTION, _FAULT, _DISABLE, _QUICK_STOP = range(4)

_ABORT_TEXT: Final[Mapping[int, str]] = {
    _NO_REACTION: "no action",
    _FAULT: "fault",
    _DISABLE: "disable voltage",
    _QUICK_STOP: "quick stop",
}


@dataclass(frozen=True)
class Comparison:
    """A number as predicted (None where nothing predicts it), from the frames, and from the simulation (or None)."""

    predicted: float | None
    measured: float
    true: float | None = None

    def holds(self, tolerance: float) -> bool:
        """Whether the measured value is within an absolute tolerance of the prediction."""
        return self.predicted is None or abs(self.measured - self.predicted) <= tolerance


@dataclass(frozen=True)
class MasterDeathReport:
    """What happened when the master died. SI units.

    Attributes:
        chain: option codes that decided, in words.
        settings: of the trial.
        speed: when the drives noticed [m/s].
        detection: from the last heartbeat to the reaction [s]; predicted by 1016h.
        stopping_time: from the reaction to rest [s]; predicted by v / a.
        stopping_distance: the same way [m]; predicted by v^2 / 2a.
        distance: from the death of the master to rest [m].
        at_rest: nothing moves at the end.
        states: of the drives at the end, by role.
        error_codes: 603Fh at the end, by role.
    """

    chain: str
    settings: StopSettings
    speed: float
    detection: Comparison
    stopping_time: Comparison
    stopping_distance: Comparison
    distance: Comparison
    at_rest: bool
    states: Mapping[str, str]
    error_codes: Mapping[str, int]

    @property
    def passed(self) -> bool:
        """The vehicle is at rest, and every prediction holds to 5 %, the detection to 5 ms."""
        predictions = (self.stopping_time, self.stopping_distance)
        return (
            self.at_rest
            and self.detection.holds(_DETECTION_TOLERANCE)
            and all(one.holds(_TOLERANCE * (one.predicted or 0.0)) for one in predictions)
        )

    def to_json(self) -> dict[str, Any]:
        """Plain data, for a file."""
        return {**asdict(self), "passed": self.passed}

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Name with unit, predicted, measured, true: text for a table."""
        named = {
            "detection s": self.detection,
            "stopping time s": self.stopping_time,
            "stopping distance m": self.stopping_distance,
            "distance since the death m": self.distance,
        }
        return [(name, _text(one.predicted), _text(one.measured), _text(one.true)) for name, one in named.items()]


def evaluate(record: StopRecord, settings: StopSettings, network: Network) -> MasterDeathReport:
    """Times and distances of a trial.

    The predictions are those of a constant deceleration a from the speed v at the reaction, v/a and v^2/2a,
    where the option codes lead to the quick stop ramp 6085h; other ways of stopping have no such formula.
    """
    way = record.travelled.mean(axis=1)
    reaction = record.reaction if record.reaction is not None else record.death
    speed = _speed(record.time, way, reaction)
    ramp = _ramps(settings)
    timeout = max(node.quantities["heartbeat_timeout"].value for node in network.drives)
    true = record.truth
    return MasterDeathReport(
        chain=_chain(settings),
        settings=settings,
        speed=speed,
        detection=Comparison(timeout, reaction - record.last_heartbeat),
        stopping_time=Comparison(
            speed / settings.deceleration if ramp else None,
            _rest(record.time, way) - reaction,
            None if true is None else _rest(record.time, true) - reaction,
        ),
        stopping_distance=Comparison(
            speed**2 / (2 * settings.deceleration) if ramp else None,
            _distance(record.time, way, reaction),
            None if true is None else _distance(record.time, true, reaction),
        ),
        distance=Comparison(
            None,
            _distance(record.time, way, record.death),
            None if true is None else _distance(record.time, true, record.death),
        ),
        at_rest=bool(np.ptp(way[record.time > record.time[-1] - 0.2]) < 1e-3),
        states={role: _state(word) for role, word in zip(DRIVES, record.statuswords[-1], strict=True)},
        error_codes=dict(zip(DRIVES, record.error_codes, strict=True)),
    )


def _speed(time: NDArray[np.float64], way: NDArray[np.float64], until: float) -> float:
    chosen = (time >= until - _SPEED_WINDOW) & (time <= until)
    if chosen.sum() < 2:
        return 0.0
    return float(np.polyfit(time[chosen] - until, way[chosen], 1)[0])


def _distance(time: NDArray[np.float64], way: NDArray[np.float64], since: float) -> float:
    return float(way[-1] - np.interp(since, time, way))


def _rest(time: NDArray[np.float64], way: NDArray[np.float64]) -> float:
    moving = np.flatnonzero(np.abs(way[-1] - way) > _REMAINDER)
    return float(time[moving[-1] + 1] if len(moving) and moving[-1] + 1 < len(time) else time[0])


def _ramps(settings: StopSettings) -> bool:
    if settings.abort == _FAULT:
        return settings.fault_reaction in _QUICK_STOP_RAMPS
    return settings.abort == _QUICK_STOP and settings.quick_stop in _QUICK_STOP_RAMPS


def _chain(settings: StopSettings) -> str:
    words = [f"6007h = {settings.abort} ({_ABORT_TEXT[settings.abort]})"]
    if settings.abort == _FAULT:
        words.append(f"605Eh = {settings.fault_reaction}")
    if settings.abort == _QUICK_STOP:
        words.append(f"605Ah = {settings.quick_stop}")
    if _ramps(settings):
        words.append(f"6085h = {settings.deceleration:g} m/s²")
    return ", ".join(words)


def _state(word: int) -> str:
    state: DriveState | None = decode_state(int(word))
    return state.label if state is not None else f"unknown ({word:04X}h)"


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"
