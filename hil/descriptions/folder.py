"""All EDS and DCF files of a network in one folder."""

from __future__ import annotations

from pathlib import Path

from hil.descriptions.dcf import write_dcf
from hil.network import Network


def write_device_files(network: Network, folder: Path) -> list[Path]:
    """Write the EDS of every kind of device, and the DCF of every node; gives the paths.

    Raises:
        OSError: a file cannot be read or written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = {node.eds.name: node.eds.read_text(encoding="utf-8") for node in network.nodes}
    files |= {f"{node.node_id:02d}_{node.role}.dcf": write_dcf(node, network) for node in network.nodes}
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in files]
