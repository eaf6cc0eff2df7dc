"""The bus as the nodes of one network share it: who listens to what, and what they hear of each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

_Entry = TypeVar("_Entry")

Handler = Callable[[int, bytes], None]
RemoteHandler = Callable[[], None]


@dataclass
class Routes:
    """CAN identifier -> (who listens, what it does with a frame).

    Attributes:
        send: transmits a frame of a node, and lets the other nodes hear it.
        produce_sync: transmits a SYNC of a node, which all nodes act on, itself included.
        sync_changed: called when a node listens to another SYNC than before, or expects another one.
        data: for data frames.
        remote: for remote frames.
    """

    send: Callable[[NodeBus, int, bytes], None]
    produce_sync: Callable[[int, bytes], None]
    sync_changed: Callable[[], None]
    data: dict[int, list[tuple[NodeBus, Handler]]] = field(default_factory=dict)
    remote: dict[int, list[tuple[NodeBus, RemoteHandler]]] = field(default_factory=dict)


class NodeBus:
    """The CAN controller of one node.

    Args:
        routes: shared by all nodes of the network.
    """

    def __init__(self, routes: Routes) -> None:
        self._routes = routes
        self._data: list[tuple[int, Handler]] = []
        self._remote: list[tuple[int, RemoteHandler]] = []
        self.sync_id = -1
        self.connected = True

    def send(self, can_id: int, data: bytes) -> None:
        """Transmit a frame; nothing leaves a node that is off the bus."""
        if self.connected:
            self._routes.send(self, can_id, data)

    def produce_sync(self, can_id: int, data: bytes) -> None:
        """Transmit a SYNC."""
        if self.connected:
            self._routes.produce_sync(can_id, data)

    def connect(self) -> None:
        """Hear and send again."""
        if not self.connected:
            self.connected = True
            for can_id, handler in self._data:
                self._routes.data.setdefault(can_id, []).append((self, handler))
            for can_id, answer in self._remote:
                self._routes.remote.setdefault(can_id, []).append((self, answer))

    def disconnect(self) -> None:
        """Neither hear nor send until `connect`; the subscriptions are kept."""
        if self.connected:
            self.connected = False
            for can_id, handler in self._data:
                _drop(self._routes.data, can_id, (self, handler))
            for can_id, answer in self._remote:
                _drop(self._routes.remote, can_id, (self, answer))

    def subscribe(self, can_id: int, handler: Handler) -> None:
        """Call `handler` with every data frame of this identifier."""
        self._data.append((can_id, handler))
        if self.connected:
            self._routes.data.setdefault(can_id, []).append((self, handler))

    def unsubscribe(self, can_id: int, handler: Handler) -> None:
        """Stop listening to an identifier."""
        self._data.remove((can_id, handler))
        if self.connected:
            _drop(self._routes.data, can_id, (self, handler))

    def answer_remote(self, can_id: int, answer: RemoteHandler) -> None:
        """Call `answer` when a remote frame asks for this identifier."""
        self._remote.append((can_id, answer))
        if self.connected:
            self._routes.remote.setdefault(can_id, []).append((self, answer))

    def ignore_remote(self, can_id: int, answer: RemoteHandler) -> None:
        """Stop answering remote frames of an identifier."""
        self._remote.remove((can_id, answer))
        if self.connected:
            _drop(self._routes.remote, can_id, (self, answer))

    def listen_to_sync(self, can_id: int) -> None:
        """The identifier of the SYNC, or what is expected in it, is this from now on."""
        self.sync_id = can_id
        self._routes.sync_changed()


def _drop(routes: dict[int, list[_Entry]], can_id: int, entry: _Entry) -> None:
    routes[can_id].remove(entry)
    if not routes[can_id]:
        del routes[can_id]
