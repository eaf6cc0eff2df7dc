"""A model of the platform with effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.effects import Effect, EffectTerm, terms_of
from ident.plant.modes import Mode
from ident.plant.places import DRIVES, ENCODERS
from ident.plant.simulation import Simulation
from ident.plant.terms import delay_at, lag_at, steering_errors
from ident.plant.transmissions import Spring, springs_of
from ident.vehicle.geometry import Geometry
from ident.vehicle.lag import Lag
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ExtendedModel:
    """Parameters (18) and the effects beside them.

    Attributes:
        parameters: p, refitted with the effects in place.
        effects: none for the plain model.
        lag: of all torques in records of the vehicle, which no simulation has; None: not known.
    """

    parameters: Parameters
    effects: tuple[Effect, ...] = ()
    lag: Lag | None = None

    @property
    def terms(self) -> list[EffectTerm]:
        """What the effects add to the equations."""
        return terms_of(self.effects)

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Gears, then couplings of the steering, that give way; compliance and play of one place are one spring."""
        return springs_of(self.terms)

    def drive_delays(self) -> Array:
        """Dead times (4,) of the drives [s]."""
        return self._delays(DRIVES)

    def drive_lags(self) -> Array:
        """Time constants (4,) with which the torques of the drives follow [s]."""
        return np.array([float(lag_at(self.terms, place)) for place in DRIVES])

    def encoder_delays(self) -> Array:
        """Dead times (2,) of the steering encoders [s]."""
        return self._delays(ENCODERS)

    def encoder_offsets(self) -> Array:
        """Zero errors (2,) of the steering encoders [rad]."""
        return np.array(ca.DM(steering_errors(self.terms))).ravel()

    def _delays(self, places: Sequence[str]) -> Array:
        return np.array([float(delay_at(self.terms, place)) for place in places])


def simulation_of(model: ExtendedModel, mode: Mode, geometry: Geometry) -> Simulation:
    """One mode of a model, forward in time."""
    return Simulation(model.parameters.values, model.terms, mode, geometry)
