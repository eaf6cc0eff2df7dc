"""What an emulated prototype was built with; loads without the physics engine."""

from __future__ import annotations

import numpy as np

from emulator.prototype import load_prototype
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters


def truth_of(prototype: str) -> Parameters:
    """True parameters of a prototype, by name or path, for the comparison at the end.

    Raises:
        DataFileError: there is no such prototype.
    """
    values = load_prototype(prototype).truth
    return Parameters(np.array([values[name] for name in PARAMETER_NAMES]), np.zeros(len(PARAMETER_NAMES)))
