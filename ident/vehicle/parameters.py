"""The eleven dynamic parameters of (18), by the paper's symbols, and how well they are known together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ident.errors import DataFileError
from ident.vehicle.quantities import Quantity, read_numbers, read_quantities, read_toml, require_table

Array = NDArray[np.float64]

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

CORRELATION: Final = "correlation"
"""Table of what their errors have in common."""

ROUNDED: Final = 1e-4
"""By how much a correlation that was written down may miss one."""

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
        correlation: (11, 11) of their errors; None: not stated.
    """

    values: Array
    std: Array
    correlation: Array | None = None

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
        return Parameters(changed, self.std, self.correlation)


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
    Beside that table may be [correlation].

    Raises:
        DataFileError: the file, the table or an entry is missing, a unit is another one, a key is not known, or the
            correlation is none.
    """
    document = read_toml(path)
    entries: Mapping[str, Any] = require_table(document, table, path)
    result = table == "parameters"
    found = parameters_from(read_quantities(entries, PARAMETER_UNITS, f"{path}: {table}", more_keys=result))
    return replace(found, correlation=_correlation(document[CORRELATION], path)) if CORRELATION in document else found


def _correlation(table: object, path: Path) -> Array:
    """(11, 11) of the table of that name."""
    remedy = f"Identify the run again, or leave [{CORRELATION}] out: errors count as independent then."
    if not isinstance(table, Mapping) or table.get("names") != list(PARAMETER_NAMES):
        raise DataFileError(f"{path}: [{CORRELATION}] does not name the parameters of (18).", remedy)
    size = len(PARAMETER_NAMES)
    matrix = read_numbers(table.get("matrix"), (size, size), f"{path}: matrix of [{CORRELATION}]", remedy)
    ones, symmetric = np.allclose(np.diag(matrix), 1.0), np.allclose(matrix, matrix.T, atol=ROUNDED)
    if not ones or not symmetric or np.linalg.eigvalsh(matrix).min() < -ROUNDED:
        raise DataFileError(f"{path}: matrix of [{CORRELATION}] is not that of a correlation.", remedy)
    return matrix
