"""The second model that ident knows: a servo axis with inertia, viscous and Coulomb friction and an offset."""

from ident.estimate.axis.identify import AxisEstimate, AxisIdentification, identify_axes, identify_axis
from ident.estimate.axis.processing import AxisProcessing

__all__ = ["AxisEstimate", "AxisIdentification", "AxisProcessing", "identify_axes", "identify_axis"]
