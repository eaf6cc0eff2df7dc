"""Records of a perfect vehicle, flawed by hand: nothing here comes from the candidates' formulas."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from ident.diagnosis.vehicle.experiment.ideal import FOUR, Drive, ideal_record
from ident.records.record import Record, Segment
from ident.vehicle.description import VehicleDescription, load_vehicle

Array = NDArray[np.float64]
Flaw = Callable[[Segment], Segment]


@dataclass(frozen=True)
class LooseMotor:
    """A motor in the play of its gear beside a wheel that stands, integrated; flanks are springs that only push.

    Attributes:
        gap, compliance: of the gear [rad, rad/Nm].
        inertia: at the wheel [kg m²].
        damping: of its contact, twice the damping ratio.
        sample_time: of what is recorded; a fortieth of it is the step [s].
    """

    gap: float
    compliance: float
    inertia: float
    damping: float
    sample_time: float = 0.002

    def thrown(self, torque: Callable[[Array], Array], seconds: float) -> tuple[Array, Array]:
        """Angle (N,) [rad] under a torque over time, and that torque (N,) [Nm]."""
        inner = self.sample_time / 40
        time = np.arange(round(seconds / inner)) * inner
        torques, angles = torque(time), np.zeros(len(time))
        damping = self.damping * math.sqrt(self.inertia / self.compliance)
        angle, rate = 0.0, 0.0
        for number, now in enumerate(torques.tolist()):
            beyond = angle - math.copysign(min(abs(angle), self.gap / 2), angle)
            load = beyond / self.compliance + (damping * rate if beyond else 0.0)
            rate += inner * (now - (load if load * beyond > 0 else 0.0)) / self.inertia
            angle += inner * rate
            angles[number] = angle
        return angles[::40], torques[::40]


@pytest.fixture(scope="session")
def loose_motor() -> type[LooseMotor]:
    return LooseMotor


@pytest.fixture(scope="session")
def prototype() -> VehicleDescription:
    return load_vehicle("prototype")


def with_torques(segment: Segment, change: Array) -> Segment:
    return replace(segment, motor_torques=segment.motor_torques + change)


def rate(values: Array, segment: Segment) -> Array:
    return np.gradient(values, segment.sample_time, axis=0)


def noisy(record: Record, seed: int, load: float = 0.01) -> Record:
    """Torques under slow changes of the load (0.1 s), shared by the motors as the load itself is, and reading noise.

    Args:
        record: without noise.
        seed: of the noise.
        load: rms of the changes [Nm at the shafts].
    """
    generator = np.random.default_rng(seed)
    segments = []
    for segment in record.segments:
        memory = np.exp(-segment.sample_time / 0.1)
        slow = signal.lfilter([np.sqrt(1 - memory**2)], [1, -memory], generator.normal(size=len(segment)))
        shared = np.linalg.svd(segment.motor_torques, full_matrices=False)[2][0]
        # Its sign is that of rounding, and with it that of the noise.
        shared *= np.sign(shared @ np.arange(1, 5) ** 2)
        reading = 0.002 * generator.normal(size=segment.motor_torques.shape)
        segments.append(with_torques(segment, 2 * load * slow[:, None] * shared + reading))
    return replace(record, segments=segments)


def flawed(record: Record, flaw: Flaw) -> Record:
    return replace(record, segments=[flaw(segment) for segment in record.segments])


@pytest.fixture(scope="session")
def drives() -> Callable[..., tuple[Record, Record]]:
    """A noisy record to fit and one to confirm, of another excitation and other noise, both with the flaw."""

    def make(vehicle: VehicleDescription, flaw: Flaw, extra: tuple[Drive, ...] = ()) -> tuple[Record, Record]:
        return tuple(  # type: ignore[return-value]
            replace(noisy(flawed(ideal_record([*FOUR, *extra], vehicle, seed), flaw), 10 + seed), source=f"run {seed}")
            for seed in (1, 2)
        )

    return make
