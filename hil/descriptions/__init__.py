"""Descriptions of the network for other tools: EDS, DCF and DBC files."""

from hil.descriptions.dbc import write_dbc
from hil.descriptions.dcf import configured_values, write_dcf
from hil.descriptions.folder import write_device_files

__all__ = ["configured_values", "write_dbc", "write_dcf", "write_device_files"]
