"""Rates of records."""

from __future__ import annotations


def nominal(sample_time: float) -> float:
    """A sample time [s] to a thousandth: that of two clocks of one rate."""
    return float(f"{sample_time:.4g}")
