"""SDO access to one node through python canopen, with errors that name node, object and remedy."""

from __future__ import annotations

import logging
import queue
from collections import deque

import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from hil.master.errors import ConfigurationError, MissingNodeError
from hil.master.link import Link
from hil.network import Node

# canopen logs a time-out as an error besides raising it; without a handler Python would print it.
logging.getLogger("canopen").addHandler(logging.NullHandler())


class _PumpedResponses:
    """Stands in for the queue that canopen's SDO client waits on: waiting runs the link."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._responses: deque[bytes] = deque()

    def put(self, response: bytes) -> None:
        """A response has arrived."""
        self._responses.append(response)

    def empty(self) -> bool:
        """True: the client asks before a request, and stale responses are dropped here."""
        self._responses.clear()
        return True

    def get(self, block: bool = True, timeout: float | None = None) -> bytes:
        """The next response.

        Raises:
            queue.Empty: there was none in `timeout` seconds of the link's clock.
        """
        if not self._link.pump(timeout or 0.0, lambda: bool(self._responses)):
            raise queue.Empty
        return self._responses.popleft()


class ObjectAccess:
    """Reads and writes objects of one node.

    Args:
        link: the bus.
        node: the node as the network file describes it.
        timeout: how long to wait for a response [s].
    """

    def __init__(self, link: Link, node: Node, timeout: float) -> None:
        self.node = node
        self._remote = canopen.RemoteNode(node.node_id, node.object_dictionary)
        self._remote.sdo.responses = _PumpedResponses(link)
        self._remote.sdo.RESPONSE_TIMEOUT = timeout
        link.add_node(self._remote)

    def read(self, index: int, subindex: int = 0) -> int:
        """Value of an integer object.

        Raises:
            MissingNodeError: no response in time.
            ConfigurationError: the node refuses.
        """
        signed = self._signed(index, subindex)
        try:
            data = self._remote.sdo.upload(index, subindex)
        except SdoCommunicationError as error:
            raise self._silent(index, subindex) from error
        except SdoAbortedError as error:
            raise self._refused("read", index, subindex, error) from error
        return int.from_bytes(data, "little", signed=signed)

    def write(self, index: int, subindex: int, value: int) -> None:
        """Write an integer object.

        Raises:
            MissingNodeError: no response in time.
            ConfigurationError: the node refuses.
        """
        length, signed = self._length(index, subindex), self._signed(index, subindex)
        try:
            self._remote.sdo.download(index, subindex, value.to_bytes(length, "little", signed=signed))
        except SdoCommunicationError as error:
            raise self._silent(index, subindex) from error
        except SdoAbortedError as error:
            raise self._refused(f"write {value:#x} to", index, subindex, error) from error

    def _variable(self, index: int, subindex: int) -> canopen.objectdictionary.ODVariable:
        variable = self.node.object_dictionary.get_variable(index, subindex)
        if variable is None:
            raise ConfigurationError(
                f"{self.node.eds} has no object {index:04X}h:{subindex}, which {self.node.label} needs.",
                "Use the EDS file of the device that is built in.",
            )
        return variable

    def _length(self, index: int, subindex: int) -> int:
        return len(self._variable(index, subindex)) // 8

    def _signed(self, index: int, subindex: int) -> bool:
        return self._variable(index, subindex).data_type in canopen.objectdictionary.SIGNED_TYPES

    def _silent(self, index: int, subindex: int) -> MissingNodeError:
        return MissingNodeError(
            f"{self.node.label} does not answer (SDO to {index:04X}h:{subindex}).",
            "Check its supply, cable, bit rate and node id, or correct the network file.",
        )

    def _refused(self, what: str, index: int, subindex: int, error: SdoAbortedError) -> ConfigurationError:
        return ConfigurationError(
            f"{self.node.label} refuses to {what} {index:04X}h:{subindex}: {error}.",
            "Compare the EDS file and the network file with the device.",
        )
