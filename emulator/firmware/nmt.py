"""NMT slave (CiA 301, 7.3.2): states, resets and boot-up."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum


class NmtState(IntEnum):
    """NMT states; the value is that of heartbeat and node guarding."""

    INITIALISATION = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class NmtCommand(IntEnum):
    """Command specifiers of the NMT protocol."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


_TARGETS = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}


class NmtSlave:
    """NMT state of one node.

    Args:
        node_id: whom commands address, besides everybody (0).
        initialise: called in a reset, with True when the application is reset too; sends nothing.
        boot_up: sends the boot-up message.
        changed: called with every new state.
        renumbered: asked with every reset command; True where the node is another one now, and this one is off.
    """

    def __init__(
        self,
        node_id: int,
        initialise: Callable[[bool], None],
        boot_up: Callable[[], None],
        changed: Callable[[NmtState], None],
        renumbered: Callable[[], bool],
    ) -> None:
        self._node_id = node_id
        self._initialise = initialise
        self._boot_up = boot_up
        self._changed = changed
        self._renumbered = renumbered
        self.state = NmtState.INITIALISATION

    def receive(self, _can_id: int, data: bytes) -> None:
        """Take an NMT message; one of a wrong length, to others or unknown is ignored."""
        if len(data) != 2 or data[1] not in (0, self._node_id):
            return
        if data[0] in (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION):
            if not self._renumbered():
                self.reset(application=data[0] == NmtCommand.RESET_NODE)
        elif data[0] in _TARGETS:
            self.enter(_TARGETS[NmtCommand(data[0])])

    def reset(self, application: bool) -> None:
        """Initialise, say so by the boot-up message, and become pre-operational."""
        self.enter(NmtState.INITIALISATION)
        self._initialise(application)
        self._boot_up()
        self.enter(NmtState.PRE_OPERATIONAL)

    def enter(self, state: NmtState) -> None:
        """Change the state and tell so, if it is another one."""
        if state is not self.state:
            self.state = state
            self._changed(state)
