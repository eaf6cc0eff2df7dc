"""How large the gap is and where it lies, in units of the noise of every coordinate."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ident.diagnosis.diagnosis import Gap, Share
from ident.diagnosis.observations.linear import ROUNDING, rms
from ident.diagnosis.observations.rows import Kept, Rows
from ident.diagnosis.problem import Block

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Series = Sequence[Array]
Told = Sequence[Mask]


def noise_floors(rows: Rows, models: Series, left: Array) -> Array:
    """Rms of the noise of every block, and of what is tolerated in it, in the unit of its target.

    It is what differs between repeats, or, without any, what a smooth function of the states leaves.

    Args:
        rows: of the blocks.
        models: of every block's target, (N,).
        left: (n,) rows minus model and minus that function.
    """
    spreads = [_spread(block, kept, model) for (block, kept), model in zip(rows.blocks, models, strict=True)]
    labels = [(block.channel, block.coordinate) for block, _ in rows.blocks]
    pooled: dict[tuple[str, str], tuple[float, int]] = {}
    for label, (variance, freedom) in zip(labels, spreads, strict=True):
        total, count = pooled.get(label, (0.0, 0))
        pooled[label] = (total + variance * freedom, count + freedom)
    values = []
    for (block, _), label, (variance, freedom), place in zip(
        rows.blocks, labels, spreads, rows.block_slices, strict=True
    ):
        total, count = pooled[label]
        if freedom == 0:
            variance = total / count if count else float(np.mean(left[place] ** 2)) if left[place].size else 0.0
        # Repeats that are the same to the last digit have the noise of that digit.
        values.append(math.hypot(math.sqrt(variance), block.tolerance, ROUNDING * rms(block.target)))
    return np.maximum(values, np.finfo(float).tiny)


def mostly_tolerated(block: Block, floor: float) -> bool:
    """Whether most of a block's noise is no noise, but what a model may lack."""
    return bool(2 * block.tolerance**2 > floor**2)


def held_out_gap(rows: Rows, floors: Array, before: Series, after: Series, told: Told = ()) -> Gap:
    """Rms over all samples of the confirming blocks, each over its noise; arguments as below."""
    return _gap(rows, floors, (before, after), None, told, means=False)


def held_out_gap_of_means(
    rows: Rows, floors: Array, before: Series, after: Series, labels: Collection[str] | None = None, told: Told = ()
) -> Gap:
    """The same of the means over the repeats, over what noise leaves of them: that is what the rows say of a cause.

    Args:
        rows: of the blocks.
        floors: rms of the noise of every block.
        before, after: models of every block's target, (N,).
        labels: of the blocks; None: all.
        told: samples (N,) of every block of which the models say something; empty: all of all blocks.
    """
    return _gap(rows, floors, (before, after), labels, told, means=True)


def _gap(
    rows: Rows,
    floors: Array,
    models: tuple[Series, Series],
    rows_with: Collection[str] | None,
    told: Told,
    *,
    means: bool,
) -> Gap:
    sums, count = np.zeros(3), 0
    for index, (block, kept) in enumerate(rows.blocks):
        left_out = rows_with is not None and block.label not in rows_with
        if left_out or not rows.confirming[rows.block_slices[index]].any():
            continue
        floor = floors[index]
        known = told_of(kept, told[index], means=means) if told else slice(None)
        seen = _means if means else _samples
        for place, model in enumerate(models):
            left = seen(kept, block.target - model[index])[known]
            power = float(np.sum((left / floor) ** 2))
            sums[place] += max(power, len(left)) if mostly_tolerated(block, floor) else power
        sums[2] += len(left)
        count += len(left)
    mean = np.sqrt(sums / count) if count else np.zeros(3)
    return Gap(float(mean[0]), float(mean[1]), float(mean[2]), count)


def told_of(kept: Kept, told: Mask, *, means: bool) -> Mask:
    """Which of the rows, or of all their samples, are told, by samples (N,) of their block."""
    chosen = told[kept.samples]
    return np.asarray(chosen.all(axis=0) if means else chosen.ravel())


def _samples(kept: Kept, residual: Array) -> Array:
    return np.asarray(residual[kept.samples.ravel()])


def _means(kept: Kept, residual: Array) -> Array:
    """Over the repeats (m,), blown up to the noise of a single one."""
    return np.asarray(math.sqrt(len(kept.samples)) * kept.mean(residual))


def shares(rows: Rows, floors: Array, before: Series) -> tuple[Share, ...]:
    """Power of the gap above the noise by coordinate and region; repeats averaged, so that noise counts little."""
    power: dict[tuple[str, str, str, str], float] = {}
    for index, (block, kept) in enumerate(rows.blocks):
        excess = _excess(block, kept, before[index], floors[index])
        whole = max(float(excess.sum()), 0.0)
        for region, mask in _regions(block, kept).items():
            key = (str(block.channel), block.step, block.coordinate, region)
            # Where noise prevails, what is above it in a region can exceed what is above it in all of them.
            power[key] = power.get(key, 0.0) + min(max(float(excess[mask].sum()), 0.0), whole)
    return shares_of([Share(*key, share=0.0, power=value) for key, value in power.items()])


def shares_of(parts: Sequence[Share]) -> tuple[Share, ...]:
    """Parts by their power, the largest first."""
    total = sum(one.power for one in parts if one.region == ALL)
    found = [replace(one, share=one.power / total if total > 0 else 0.0) for one in parts]
    return tuple(sorted(found, key=lambda share: -share.share))


ALL: Final = "all"
"""Region that is all of a coordinate."""


def repeated(rows: Rows, floors: Array, models: Series) -> Mapping[str, float]:
    """Rms over the noise of what repeats, by coordinate; only of blocks with repeats."""
    sums: dict[str, tuple[float, int]] = {}
    for index, (block, kept) in enumerate(rows.blocks):
        if len(kept.samples) < 2 or not kept.samples.size:
            continue
        excess = _excess(block, kept, models[index], floors[index])
        total, count = sums.get(block.label, (0.0, 0))
        sums[block.label] = (total + float(excess.sum()), count + len(excess))
    return {label: float(np.sqrt(max(total, 0.0) / max(count, 1))) for label, (total, count) in sums.items()}


def _excess(block: Block, kept: Kept, model: Array, floor: float) -> Array:
    """Power (m,) of the mean over the repeats, above what noise leaves of it, over the noise."""
    mean = kept.mean(block.target - model)
    return np.asarray((mean / floor) ** 2 - 1 / len(kept.samples))


def _regions(block: Block, kept: Kept) -> Mapping[str, NDArray[np.bool_]]:
    first = kept.samples[0]
    return {ALL: np.ones(len(first), dtype=bool)} | {name: mask[first] for name, mask in block.regions.items()}


def _spread(block: Block, kept: Kept, model: Array) -> tuple[float, int]:
    repeats, count = kept.samples.shape
    if repeats < 2 or count == 0:
        return 0.0, 0
    residual = (block.target - model)[kept.samples]
    return float(residual.var(axis=0, ddof=1).mean()), (repeats - 1) * count
