"""An exam as it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hil.exam.drawing import Composition


@dataclass(frozen=True)
class Order:
    """What every exam is asked for by.

    Attributes:
        out: folder.
        composition: how many cases of each kind.
        key: file of the secret that everything is drawn from, made where it is missing; None: not sealed.
        first_seed: without a key, the first of the noise, two a case, of the excitations, and of everything drawn.
        jobs: processes on this machine.
        scheduler: of a Dask cluster, None for this machine.
    """

    out: Path
    composition: Composition
    key: Path | None
    first_seed: int | None
    jobs: int
    scheduler: str | None
