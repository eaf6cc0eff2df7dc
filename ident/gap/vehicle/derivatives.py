"""Derivatives of signals in which motors ring: central differences of fourth order.

Those of second order, which serve the estimate below 40 rad/s, show at 500 Hz 8 % too little of the acceleration of a
motor that rings at 490 rad/s on the compliance of its gear, and make that compliance so much larger.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.estimate.filters import differentiate, second_derivative

Array = NDArray[np.float64]


def rates(values: Array, sample_time: float) -> Array:
    """First derivative along axis 0; of second order within two samples of the ends."""
    found = differentiate(values, sample_time)
    near, far = values[3:-1] - values[1:-3], values[4:] - values[:-4]
    found[2:-2] = (8 * near - far) / (12 * sample_time)
    return found


def accelerations(values: Array, sample_time: float) -> Array:
    """Second derivative along axis 0; of second order within two samples of the ends."""
    found = second_derivative(values, sample_time)
    near, far = values[3:-1] + values[1:-3], values[4:] + values[:-4]
    found[2:-2] = (16 * near - far - 30 * values[2:-2]) / (12 * sample_time**2)
    return found
