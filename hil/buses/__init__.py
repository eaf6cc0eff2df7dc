"""CAN buses: in-process lockstep, between processes, and every interface that python-can knows."""

from hil.buses.lockstep import LockstepBus, LockstepHub
from hil.buses.opening import open_bus, open_served_bus
from hil.buses.unix import UnixBus, UnixHub

__all__ = ["LockstepBus", "LockstepHub", "UnixBus", "UnixHub", "open_bus", "open_served_bus"]
