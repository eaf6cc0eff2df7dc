"""What can be wrong with a network, one class each, so that programs can distinguish them."""

from __future__ import annotations

from ident.errors import BusError


class MissingNodeError(BusError):
    """A node does not answer."""


class IdentityError(BusError):
    """A node is another device than the network file says."""


class UnitsError(BusError):
    """A node counts or scales otherwise than the network file says."""


class ModeError(BusError):
    """A drive does not support, or does not take, the mode of operation."""


class ConfigurationError(BusError):
    """A node refuses an SDO access."""


class DriveStateError(BusError):
    """A drive does not reach, or has left, the state that it should be in."""


class NodeLostError(BusError):
    """A node that was running has fallen silent or left the NMT state operational."""
