"""What an emulated prototype was built with; loads without the physics engine."""

from __future__ import annotations

from emulator.prototype import load_prototype
from hil.bench.prototypes import is_vehicle_file
from ident.vehicle.description import load_vehicle
from ident.vehicle.parameters import Parameters, exact_parameters


def truth_of(prototype: str) -> Parameters:
    """True parameters of a prototype, by name or path, for the comparison at the end; in a rehearsal by a vehicle file
    they are its prior.

    Raises:
        DataFileError: there is no such prototype.
    """
    values = load_vehicle(prototype).prior if is_vehicle_file(prototype) else load_prototype(prototype).truth
    return exact_parameters(values)
