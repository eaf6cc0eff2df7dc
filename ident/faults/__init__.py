"""Faults of the record: what a recorder, a cable, a unit or a sign does to channels, named apart from the machine."""

from ident.faults.fault import Fault, FaultName
from ident.faults.find import find_faults, sure_faults

__all__ = ["Fault", "FaultName", "find_faults", "sure_faults"]
