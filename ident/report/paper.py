"""Table 2 of the source paper, to stand beside a result."""

from __future__ import annotations

from dataclasses import dataclass

from ident.vehicle.description import find_data_file
from ident.vehicle.parameters import Parameters, read_parameters
from ident.vehicle.quantities import read_quantities, read_toml, require_table


@dataclass(frozen=True)
class PaperResult:
    """What the paper prints in section 7.

    Attributes:
        parameters: Table 2 with its standard deviations, and B_w, for which none is printed (zero).
        condition: cond(Θ₁ᵀΘ₁) of the normalised matrix [-].
    """

    parameters: Parameters
    condition: float


def load_paper_result() -> PaperResult:
    """Read the shipped Table 2."""
    path = find_data_file("ident.report", "paper_table2")
    quality = read_quantities(require_table(read_toml(path), "quality", path), {"condition": "1"}, f"{path}: quality")
    return PaperResult(read_parameters(path, "parameters"), quality["condition"].value)
