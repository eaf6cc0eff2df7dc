"""A model of the platform with effects: parameters and `[[effects]]` of one file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ident.effects import Effect, EffectTerm, terms_of
from ident.effects.text import effects_text, read_effects
from ident.plant.modes import Mode
from ident.plant.places import DRIVES, ENCODERS
from ident.plant.simulation import Simulation
from ident.plant.terms import delay_at, steering_errors
from ident.plant.transmissions import Spring, springs_of
from ident.vehicle.geometry import Geometry, geometry_text
from ident.vehicle.parameters import PARAMETER_NAMES, PARAMETER_UNITS, Parameters, read_parameters
from ident.vehicle.quantities import read_toml
from ident.writing import write_whole

Array = NDArray[np.float64]

SCHEMA: Final = "quasiomni.parameters/1"


@dataclass(frozen=True)
class ExtendedModel:
    """Parameters (18) and the effects beside them.

    Attributes:
        parameters: p, refitted with the effects in place.
        effects: none for the plain model.
    """

    parameters: Parameters
    effects: tuple[Effect, ...] = ()

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


def read_model(path: Path) -> ExtendedModel:
    """The model of a `parameters.toml`, effects included.

    Raises:
        DataFileError: the file cannot be used; says where.
    """
    return ExtendedModel(read_parameters(path), read_effects(read_toml(path), str(path)))


def model_text(model: ExtendedModel, provenance: Mapping[str, str], geometry: Geometry | None = None) -> str:
    """A `parameters.toml`; `provenance` says where the values come from, `geometry` for which lengths they hold."""
    source = json.dumps(provenance.get("run", "record"))
    lines = [f'schema = "{SCHEMA}"', "", "[source]"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in provenance.items()]
    for name, value, std in zip(PARAMETER_NAMES, model.parameters.values, model.parameters.std, strict=True):
        entry = [f"value = {value:.9g}", f'unit = "{PARAMETER_UNITS[name]}"', f"std = {std:.6g}", f"source = {source}"]
        lines += ["", f"[parameters.{name}]", *entry]
    lengths = "" if geometry is None else geometry_text(geometry, provenance.get("vehicle", "vehicle file"))
    return "\n".join(lines) + "\n" + lengths + effects_text(model.effects)


def write_model(
    model: ExtendedModel, path: Path, provenance: Mapping[str, str], geometry: Geometry | None = None
) -> None:
    """Write the file whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(model_text(model, provenance, geometry), path)
