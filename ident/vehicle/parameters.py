"""The eleven dynamic parameters of (18), by the paper's symbols."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.vehicle.quantities import Quantity, read_quantities, read_toml, require_table

PARAMETER_UNITS: Final = {
    "C_l": "kg m^2",
    "d_vl": "Nm s/rad",
    "d_cl": "Nm",
    "C_r": "kg m^2",
    "d_vr": "Nm s/rad",
    "d_cr": "Nm",
    "m_ch": "kg",
    "C_ch": "kg m^2",
    "d_vw": "Nm s/rad",
    "d_cw": "Nm",
    "B_w": "kg m^2",
}
PARAMETER_NAMES: Final = tuple(PARAMETER_UNITS)
"""Order of (18)."""

COULOMB_EPSILON: Final = 0.01
"""ε of tanh(rate/ε) in (16) [rad/s]; paper, section 7."""


def parameter_column(name: str) -> int:
    """Place of a parameter in p, and of its column in every regressor."""
    return PARAMETER_NAMES.index(name)


@dataclass(frozen=True)
class Parameters:
    """Values and standard deviations of p (18).

    Attributes:
        values: (11,) in the order of PARAMETER_NAMES.
        std: (11,) standard uncertainties, zero where none is known.
    """

    values: NDArray[np.float64]
    std: NDArray[np.float64]

    def __getitem__(self, name: str) -> float:
        """Value of one parameter by its symbol."""
        return float(self.values[parameter_column(name)])

    def std_of(self, name: str) -> float:
        """Standard uncertainty of one parameter by its symbol."""
        return float(self.std[parameter_column(name)])

    def replaced(self, **values: float) -> Parameters:
        """A copy with some values changed."""
        changed = self.values.copy()
        for name, value in values.items():
            changed[parameter_column(name)] = value
        return Parameters(changed, self.std)


def exact_parameters(values: Mapping[str, float] | Parameters) -> Parameters:
    """Parameters from a number of all eleven, known without uncertainty."""
    return Parameters(np.array([values[name] for name in PARAMETER_NAMES]), np.zeros(len(PARAMETER_NAMES)))


def parameters_from(quantities: Mapping[str, Quantity]) -> Parameters:
    """Parameters from a mapping of all eleven quantities."""
    return Parameters(
        np.array([quantities[name].value for name in PARAMETER_NAMES]),
        np.array([quantities[name].std for name in PARAMETER_NAMES]),
    )


def read_parameters(path: Path, table: str) -> Parameters:
    """Parameters from the table of that name in a TOML file.

    Entries of [parameters], which an identification writes, hold more than value, unit, std and source; it is ignored.

    Raises:
        DataFileError: the file, the table or an entry is missing, a unit is another one, or a key is not known.
    """
    entries: Mapping[str, Any] = require_table(read_toml(path), table, path)
    result = table == "parameters"
    return parameters_from(read_quantities(entries, PARAMETER_UNITS, f"{path}: {table}", more_keys=result))
