"""Which single law closes most of the held-out gap of a servo axis, by least squares alone.

    python examples/held_out_laws.py ~/published kr300
    python examples/held_out_laws.py ~/published --moving 0.05

An answer to compare the diagnosis with, so it shares nothing with it: positions pass a low pass forward and backward,
effort and columns pass it once more, M a + Fv v + Fc sign(v) + offset is fitted with and without the columns of a law,
and the rms of what it leaves is taken where nothing was fitted. The best law stays, and all others are tried beside it.
At rest a friction has any value up to that of sliding: with `--moving` rows of less than a share of the speed, and half
a period of the cutoff beside them, are left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from held_out_columns import LAWS, Array, Axis, Columns, axes_of, baseline
from numpy.typing import NDArray
from published_machines import ROWS, read_row
from scipy import ndimage, signal

from ident.records.axis_record import AxisRecord

ROUNDS: Final = 4
RATE: Final = 4.0
"""Rows an oscillation at the cutoff."""
BLOCKS: Final = 10
"""Of a record without another to confirm it; every second one is held out."""
ORDER: Final = 8
"""Of the autoregression that whitens rows where that is asked for."""
ENOUGH: Final = 0.98
"""A law that leaves more than this part of the rms is no further one."""


@dataclass(frozen=True)
class Part:
    """One record, the rows of it, and which of them are held out.

    Attributes:
        axis: of the record.
        rows: (n,) samples.
        held: (n,) held out, or fitted.
        whitening: (p,) weights of a row and those before it; (1,) leaves them alone.
    """

    axis: Axis
    rows: NDArray[np.int64]
    held: NDArray[np.bool_]
    whitening: Array

    def of(self, values: Array, held: bool) -> Array:
        """Columns or the effort (N, ...) in the rows that are held out or fitted, but for the first ones."""
        white = signal.lfilter(self.whitening, 1.0, self.axis.smooth(values)[self.rows], axis=0)
        whole = np.arange(len(self.rows)) >= len(self.whitening) - 1
        return np.asarray(white[whole & (self.held == held)])


def parts_of(
    fit: Sequence[AxisRecord], confirm: Sequence[AxisRecord], name: str, cutoff: float, moving: float = 0.0
) -> list[Part]:
    """All records of an axis; without any that confirm, every second block of each is held out.

    Args:
        fit, confirm: records.
        name: of the axis.
        cutoff: of the low pass [Hz].
        moving: share of a large speed below which an axis rests.
    """
    parts = []
    for at, record in enumerate([*fit, *confirm]):
        number = [axis.name for axis in record.axes].index(name)
        step = max(1, int(1 / (RATE * cutoff * record.sample_time)))
        axis = axes_of(record, cutoff)[number]
        rows = np.arange(0, len(record), step)[5:-5]
        rows = rows[~resting(axis, moving)[rows]]
        odd = (rows * BLOCKS // len(record)) % 2 == 1
        held = odd if not confirm else np.full(len(rows), at >= len(fit))
        parts.append(Part(axis, rows, held, np.ones(1)))
    return parts


def resting(axis: Axis, moving: float) -> NDArray[np.bool_]:
    """Samples (N,) slower than a share of a large speed, and half a period of the cutoff before and after them."""
    slow = np.abs(axis.speed) < moving * axis.scale
    return np.asarray(ndimage.binary_dilation(slow, np.ones(2 * round(0.5 / axis.cutoff / axis.interval) + 1)))


def whitened(parts: Sequence[Part]) -> list[Part]:
    """The same rows behind an autoregression of what the baseline leaves of them, one for all."""
    kept = [baseline(part.axis) for part in parts]
    solution = _solution(_matrix(kept, parts, held=False), _effort(parts, held=False))
    left = [
        part.axis.smooth(part.axis.effort - np.column_stack(of) @ solution)[part.rows]
        for part, of in zip(parts, kept, strict=True)
    ]
    lagged = np.vstack([np.column_stack([one[ORDER - lag : -lag] for lag in range(1, ORDER + 1)]) for one in left])
    colour = np.linalg.lstsq(lagged, np.concatenate([one[ORDER:] for one in left]))[0]
    return [replace(part, whitening=np.r_[1.0, -colour]) for part in parts]


def _matrix(columns: Sequence[Columns], parts: Sequence[Part], held: bool) -> Array:
    return np.vstack([part.of(np.column_stack(of), held) for part, of in zip(parts, columns, strict=True)])


def _effort(parts: Sequence[Part], held: bool) -> Array:
    return np.concatenate([part.of(part.axis.effort, held) for part in parts])


def _solution(matrix: Array, effort: Array) -> Array:
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-30)
    return np.asarray(np.linalg.lstsq(matrix / scale, effort, rcond=1e-8)[0] / scale)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def best_forms(parts: Sequence[Part], kept: Sequence[Columns]) -> Iterator[tuple[float, str, list[Columns]]]:
    """For each law: what it leaves held out [N or Nm], its name, and its columns in every record."""
    base, held = _matrix(kept, parts, held=False), _matrix(kept, parts, held=True)
    effort, unseen = _effort(parts, held=False), _effort(parts, held=True)
    weights = _solution(base, effort)
    loads = [np.column_stack(of) @ weights for of in kept]
    for name, law in LAWS.items():
        best = np.inf
        found: list[tuple[float, str, list[Columns]]] = []
        for forms in zip(*(law(part.axis, load) for part, load in zip(parts, loads, strict=True)), strict=True):
            whole = np.hstack([base, _matrix(forms, parts, held=False)])
            solution = _solution(whole, effort)
            seen = _rms(effort - whole @ solution)
            if seen < best:
                best, test = seen, np.hstack([held, _matrix(forms, parts, held=True)])
                found = [(_rms(unseen - test @ solution), name, list(forms))]
        yield from found


def report(title: str, parts: Sequence[Part]) -> Iterator[str]:
    """Lines of the gap of an axis, law after law, each with what closes most beside it."""
    kept = [baseline(part.axis) for part in parts]
    solution = _solution(_matrix(kept, parts, held=False), _effort(parts, held=False))
    gap = _rms(_effort(parts, held=True) - _matrix(kept, parts, held=True) @ solution)
    yield f"{title}: effort {_rms(_effort(parts, held=True)):.4g}, gap {gap:.4g}"
    left = gap
    for _ in range(ROUNDS):
        tried = sorted(best_forms(parts, kept), key=lambda form: form[0])
        value, law, columns = tried[0]
        if value > ENOUGH * left:
            return
        others = ", ".join(f"{other} {1 - (rms / gap) ** 2:.2f}" for rms, other, _ in tried[1:6])
        yield f"  {law}: leaves {value:.4g}, closes {1 - (value / gap) ** 2:.2f} (else {others})"
        kept, left = [of + more for of, more in zip(kept, columns, strict=True)], value


def main() -> None:
    """Print the laws of the rows asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where the repositories are")
    parser.add_argument("machines", nargs="*", help="of which machines, all by default")
    parser.add_argument("--whiten", action="store_true", help="weigh rows as their noise is coloured")
    parser.add_argument("--moving", type=float, default=0.0, metavar="SHARE", help="of a large speed; slower is rest")
    given = parser.parse_args()
    if given.whiten and given.moving:
        parser.error("Rows are weighed by those before them, which --moving leaves out. Name one of the two.")
    for row in ROWS:
        if given.machines and row.machine not in given.machines:
            continue
        fit, confirm = read_row(row, given.folder)
        for axis in fit[0].axes:
            parts = parts_of(fit, confirm, axis.name, row.cutoff, given.moving)
            title = f"{row.machine} {row.title} {axis.named('axis')}"
            for line in report(title, whitened(parts) if given.whiten else parts):
                print(line, flush=True)


if __name__ == "__main__":
    main()
