"""Fault injection: what can go wrong between a master and a vehicle, on purpose, seeded, at an instant."""

from hil.faults.fault import Fault, FaultKind, parse_fault, parse_script
from hil.faults.injector import FaultInjector

__all__ = ["Fault", "FaultInjector", "FaultKind", "parse_fault", "parse_script"]
