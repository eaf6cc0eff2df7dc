"""An identified model, with the effects that were diagnosed, as what the emulated vehicle is made of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from emulator.reparametrised import with_truth
from hil.bench.prototypes import Emulated, derive_emulated, is_vehicle_file, load_emulated
from hil.network.described import load_described
from ident.errors import DataFileError, UserError
from ident.vehicle.geometry import GEOMETRY_UNITS, Geometry, read_geometry
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import read_toml

if TYPE_CHECKING:
    from ident.effects import Effect
    from ident.effects.extended import ExtendedModel


@dataclass(frozen=True)
class Simulator:
    """A `parameters.toml` that an emulated vehicle is made from.

    Attributes:
        path: of the file.
        model: its parameters and effects.
        geometry: of the vehicle that it was found for; None where the file does not say.
    """

    path: Path
    model: ExtendedModel
    geometry: Geometry | None = None

    def with_more(self, effects: Sequence[Effect]) -> tuple[Effect, ...]:
        """Its effects, and others added to them."""
        from ident.effects.combining import combined  # loads the mathematics of effects, which few vehicles have

        return combined(self.model.effects, effects)


def read_simulator(path: Path, *, force: bool = False) -> Simulator:
    """The model of a file.

    Args:
        path: a `parameters.toml`, with `[[effects]]` or without.
        force: take one that was assessed as unusable all the same.

    Raises:
        DataFileError: the file cannot be used; says where.
        UserError: it was assessed as unusable.
    """
    from ident.assessment.file import refuse_unusable  # both load the estimation, which a prototype does without
    from ident.parameters_file import read_model

    document = read_toml(path)
    refuse_unusable(document, str(path), force=force)
    model = read_model(path)
    for name in PARAMETER_NAMES:
        if not model.parameters[name] > 0:
            raise DataFileError(
                f"{path}: {name} = {model.parameters[name]:.4g} is no parameter of a vehicle.",
                "The emulator needs all eleven above zero: identify from a record that shows it, or give --b-w.",
            )
    return Simulator(path, model, read_geometry(document["geometry"], path) if "geometry" in document else None)


def load_simulated(name_or_path: str | Path, network: Path, simulator: Simulator | None) -> Emulated:
    """The prototype of that name or file, with the parameters of a model in place of its own.

    Args:
        name_or_path, network: as `load_emulated` takes them.
        simulator: None: the prototype as it is.

    Raises:
        DataFileError: a file is missing or malformed, no bodies have these parameters, or they are of another vehicle.
    """
    if simulator is None:
        return load_emulated(name_or_path, network)
    if is_vehicle_file(name_or_path):
        described = load_described(name_or_path, network)
        _refuse_other_vehicle(simulator, described.vehicle.geometry, str(name_or_path))
        # Masses of wheels and knuckles are assumed in proportion to the parameters, so they are derived from these.
        vehicle = replace(described.vehicle, prior=simulator.model.parameters, path=simulator.path)
        return derive_emulated(replace(described, vehicle=vehicle))
    emulated = load_emulated(name_or_path, network)
    _refuse_other_vehicle(simulator, emulated.prototype.geometry, str(name_or_path))
    return replace(emulated, prototype=with_truth(emulated.prototype, simulator.model.parameters, simulator.path))


def _refuse_other_vehicle(simulator: Simulator, geometry: Geometry, name: str) -> None:
    if simulator.geometry is None:
        return
    changed = [
        f"{length} {getattr(simulator.geometry, length):.6g}, there {getattr(geometry, length):.6g} {unit}"
        for length, unit in GEOMETRY_UNITS.items()
        if abs(getattr(simulator.geometry, length) - getattr(geometry, length)) > 1e-9
    ]
    if changed:
        raise DataFileError(
            f"{simulator.path} is a model of another vehicle than {name}: {'; '.join(changed)}.",
            "Name the vehicle that it was identified on, or another model.",
        )


@contextmanager
def naming(simulator: Simulator | None) -> Iterator[None]:
    """What the emulated vehicle cannot have is said of the file that asks for it."""
    try:
        yield
    except UserError as error:
        if simulator is None or str(simulator.path) in error.what:
            raise
        remedy = f"{error.remedy} Or take that [[effects]] entry out of the file."
        raise UserError(f"{simulator.path}: {error.what}", remedy) from error
