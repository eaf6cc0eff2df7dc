"""Where a fault is: from the words of a fault to identifiers, nodes, wheels."""

from __future__ import annotations

from dataclasses import dataclass

from hil.faults.fault import Fault, FaultError, FaultKind
from hil.faults.frames import Selection, any_frame, heartbeat_of, identifiers, sent_by_master, sent_by_node
from hil.network import Network
from hil.network.cia import HIGHEST_CAN_ID
from ident.vehicle.geometry import WHEELS

MASTER = "master"
ALL = "all"
FLOOR = "floor"
VEHICLE = "vehicle"


@dataclass(frozen=True)
class Places:
    """The places of one network; nodes are named by their roles, or as `node3`."""

    network: Network

    def node(self, name: str) -> int:
        """The id of a node.

        Raises:
            FaultError: there is no such node.
        """
        by_name = {str(node.role): node.node_id for node in self.network.nodes}
        by_name |= {f"node{node.node_id}": node.node_id for node in self.network.nodes}
        if name not in by_name:
            raise _no_place(name, list(by_name))
        return by_name[name]

    def drive(self, name: str) -> int:
        """The id of a drive.

        Raises:
            FaultError: there is no such drive.
        """
        node_id = self.node(name)
        drives = {node.node_id: str(node.role) for node in self.network.drives}
        if node_id not in drives:
            raise _no_place(name, list(drives.values()))
        return node_id

    def vehicle(self, name: str) -> tuple[int, ...]:
        """The ids of the drives of a whole vehicle.

        Raises:
            FaultError: it is none.
        """
        if name != VEHICLE:
            raise _no_place(name, [VEHICLE])
        return tuple(node.node_id for node in self.network.drives)

    def selection(self, fault: Fault) -> Selection:
        """The frames that a fault of frames is about.

        Raises:
            FaultError: there is no such place.
        """
        if fault.kind is FaultKind.HEARTBEAT:
            return heartbeat_of(self.network.master_id if fault.place == MASTER else self.node(fault.place))
        if fault.kind is FaultKind.DEATH and fault.place != MASTER:
            raise _no_place(fault.place, [MASTER])
        if fault.place in (ALL, MASTER):
            return any_frame if fault.place == ALL else sent_by_master
        if fault.place[:1].isdigit():
            low, _, high = fault.place.partition("-")
            return identifiers(identifier(low), identifier(high or low))
        return sent_by_node(self.node(fault.place))

    def wheels(self, name: str) -> tuple[int, ...]:
        """The wheels on a piece of ground: all on the `floor`, or one.

        Raises:
            FaultError: there is no such wheel.
        """
        names: dict[str, tuple[int, ...]] = {f"wheel_{wheel}": (number,) for number, wheel in enumerate(WHEELS)}
        names[FLOOR] = tuple(range(len(WHEELS)))
        if name not in names:
            raise _no_place(name, list(names))
        return names[name]

    def hardware(self, name: str) -> tuple[str, int]:
        """Kind (`drives`, `encoders`) and number of the hardware below a node.

        Raises:
            FaultError: there is no such node.
        """
        node_id = self.node(name)
        drives = [node.node_id for node in self.network.drives]
        if node_id in drives:
            return "drives", drives.index(node_id)
        return "encoders", [node.node_id for node in self.network.encoders].index(node_id)


def identifier(text: str) -> int:
    """An 11-bit identifier.

    Raises:
        FaultError: it is none.
    """
    try:
        value = int(text, 0)
    except ValueError:
        value = -1
    if not 0 <= value <= HIGHEST_CAN_ID:
        raise FaultError(f"{text!r} is no 11-bit identifier.", "Write for example 0x181.")
    return value


def _no_place(name: str, known: list[str]) -> FaultError:
    return FaultError(f"There is no {name!r} for this fault.", f"Use one of {', '.join(known)}.")
