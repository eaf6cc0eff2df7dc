"""The network file: which nodes are on the bus, how they are wired, and what their PDOs carry."""

from hil.network.description import (
    DRIVES,
    ENCODERS,
    Identity,
    MappedObject,
    Network,
    Node,
    Pdo,
    PdoDirection,
    Role,
)
from hil.network.reader import DEFAULT_NETWORK, load_network, network_file_of

__all__ = [
    "DEFAULT_NETWORK",
    "DRIVES",
    "ENCODERS",
    "Identity",
    "MappedObject",
    "Network",
    "Node",
    "Pdo",
    "PdoDirection",
    "Role",
    "load_network",
    "network_file_of",
]
