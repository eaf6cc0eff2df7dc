"""A model of the platform with effects: parameters and `[[effects]]` of one file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.vehicle.effect_terms import TERMS, EffectTerm, term_of
from ident.vehicle.effect_text import effects_text, read_effects
from ident.vehicle.effects import DRIVES, ENCODERS, STEERING, Effect, EffectName
from ident.vehicle.flexible import Spring
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
        """The effects that are terms of the equations."""
        return [term_of(effect) for effect in self.effects if effect.name in TERMS]

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Gears, then couplings of the steering, that give way; compliance and play of one place are one spring."""
        found = []
        for places in (DRIVES, STEERING):
            compliances = self._sizes(EffectName.ELASTICITY, places)
            gaps = self._sizes(EffectName.BACKLASH, places)
            found += [
                Spring(places is DRIVES, place, float(compliance), float(gap))
                for place, (compliance, gap) in enumerate(zip(compliances, gaps, strict=True))
                if compliance or gap
            ]
        return tuple(found)

    def drive_delays(self) -> Array:
        """Dead times (4,) of the drives [s]."""
        return self._sizes(EffectName.TIME_DELAY, DRIVES)

    def encoder_delays(self) -> Array:
        """Dead times (2,) of the steering encoders [s]."""
        return self._sizes(EffectName.TIME_DELAY, ENCODERS)

    def encoder_offsets(self) -> Array:
        """Zero errors (2,) of the steering encoders [rad]."""
        return self._sizes(EffectName.STEERING_OFFSET, STEERING)

    def _sizes(self, name: EffectName, places: Sequence[str]) -> Array:
        sizes = np.zeros(len(places))
        for effect in self.effects:
            if effect.name is name and effect.where in places:
                sizes[places.index(effect.where)] += effect.size
        return sizes


def read_model(path: Path) -> ExtendedModel:
    """The model of a `parameters.toml`, effects included.

    Raises:
        DataFileError: the file cannot be used; says where.
    """
    return ExtendedModel(read_parameters(path), read_effects(read_toml(path), str(path)))


def model_text(model: ExtendedModel, provenance: Mapping[str, str]) -> str:
    """A `parameters.toml`; `provenance` says where the values come from."""
    source = json.dumps(provenance.get("run", "record"))
    lines = [f'schema = "{SCHEMA}"', "", "[source]"]
    lines += [f"{key} = {json.dumps(value)}" for key, value in provenance.items()]
    for name, value, std in zip(PARAMETER_NAMES, model.parameters.values, model.parameters.std, strict=True):
        entry = [f"value = {value:.9g}", f'unit = "{PARAMETER_UNITS[name]}"', f"std = {std:.6g}", f"source = {source}"]
        lines += ["", f"[parameters.{name}]", *entry]
    return "\n".join(lines) + "\n" + effects_text(model.effects)


def write_model(model: ExtendedModel, path: Path, provenance: Mapping[str, str]) -> None:
    """Write the file whole or not at all.

    Raises:
        UserError: it cannot be written.
    """
    write_whole(model_text(model, provenance), path)
