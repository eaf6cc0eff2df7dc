"""What an FMU is made from: a vehicle, its identified parameters, its confirmed effects, and where they come from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fmu.model.generate import generate_core
from fmu.parameter_rows import parameters_of
from fmu.table import neutral_effects, variable_table
from fmu.variables import Carried, Inputs, VariableTable
from ident.effects import Effect
from ident.errors import DataFileError
from ident.plant.contact import Contacts
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters


@dataclass(frozen=True)
class ModelSource:
    """What an FMU is made from.

    Attributes:
        vehicle: geometry and limits.
        parameters: identified, with standard deviations.
        effects: confirmed, each once at a place.
        provenance: what a reader must know to repeat it, by name.
        documents: files that go along as they are, by file name.

    Raises:
        DataFileError: an effect is twice at a place; its parameters would have one name.
    """

    vehicle: VehicleDescription
    parameters: Parameters
    effects: tuple[Effect, ...]
    provenance: Mapping[str, str]
    documents: Mapping[str, bytes]

    def __post_init__(self) -> None:
        for effect, count in Counter(str(effect) for effect in self.effects).items():
            if count > 1:
                raise DataFileError(
                    f"{effect} is there {count} times; the parameters of an FMU are named by effect and place.",
                    "Write one entry of it into the file of parameters, or diagnose again with a model that has none.",
                )

    @property
    def standard_deviations(self) -> Mapping[str, float]:
        """Of the FMU's parameters, by name, where they are known."""
        known = {name: self.parameters.std_of(name) for name in PARAMETER_NAMES}
        for effect in self.effects:
            for name, quantity in effect.parameters.items():
                known.update(dict.fromkeys(parameters_of(effect, name), quantity.std))
        return {name: std for name, std in known.items() if std > 0}


@dataclass(frozen=True)
class Model:
    """The model of an FMU.

    Attributes:
        table: of its variables.
        files: C sources by name.
        dependencies: derivative or output -> the states and inputs that it depends on.
        fastest: time constant [s], at rest.
    """

    table: VariableTable
    files: Mapping[str, str]
    dependencies: Mapping[str, tuple[str, ...]]
    fastest: float


def make_model(
    source: ModelSource,
    inputs: Inputs,
    contacts: Contacts = Contacts.STIFF,
    limited: bool = False,
    carried: Carried = Carried.STATELESS,
) -> Model:
    """The model with the confirmed effects, and with those of size zero that it shall carry."""
    effects = with_neutral(source.effects, carried)
    table = variable_table(source.vehicle, source.parameters, effects, inputs, contacts, limited)
    core = generate_core(table, effects, inputs)
    return Model(table, core.files, core.dependencies, core.fastest)


def with_neutral(confirmed: Sequence[Effect], carried: Carried = Carried.STATELESS) -> list[Effect]:
    """Effects of an FMU: the confirmed ones, and those of size zero that it shall carry."""
    found = {(effect.name, effect.where) for effect in confirmed}
    return [*confirmed, *(effect for effect in neutral_effects(carried) if (effect.name, effect.where) not in found)]
