"""All EDS and DCF files of a network in one folder."""

from __future__ import annotations

import itertools
from pathlib import Path

from hil.descriptions.dcf import write_dcf
from hil.network import Network
from ident.writing import refuse_inputs, write_whole


def write_device_files(network: Network, folder: Path) -> list[Path]:
    """Write the EDS of every kind of device, and the DCF of every node; gives the paths.

    EDS files of one name from several folders get numbers.

    Raises:
        OSError: a file cannot be read.
        UserError: a file cannot be written, or is one that the network is described by.
    """
    names = _eds_names(network)
    files = {name: eds.read_bytes() for eds, name in names.items()}
    files |= {
        f"{node.node_id:02d}_{node.role}.dcf": write_dcf(node, network, names[node.eds]).encode()
        for node in network.nodes
    }
    refuse_inputs([folder / name for name in files], [network.path, *names])
    for name, content in files.items():
        write_whole(content, folder / name)
    return [folder / name for name in files]


def _eds_names(network: Network) -> dict[Path, str]:
    """Names under which the EDS files can lie in one folder."""
    names: dict[Path, str] = {}
    for eds in dict.fromkeys(node.eds for node in network.nodes):
        numbered = (f"{eds.stem}_{number}{eds.suffix}" for number in itertools.count(2))
        names[eds] = next(name for name in itertools.chain([eds.name], numbered) if name not in names.values())
    return names
