"""Describing a vehicle of one's own: vehicle file, network file and EDS files from a few numbers."""

from hil.describing.files import write_description
from hil.describing.measures import ASKED, DEFAULTS, Measures, check_measures

__all__ = ["ASKED", "DEFAULTS", "Measures", "check_measures", "write_description"]
