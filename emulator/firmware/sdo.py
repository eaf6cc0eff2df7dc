"""SDO server: durand's, with the end of a block upload as CiA 301, 7.2.4.3.15 has it."""

from __future__ import annotations

from binascii import crc_hqx

from durand.services.sdo import SDOServer
from durand.services.sdo.server import TransferState
from durand.services.sdo.upload import UploadManager

_SEGMENT = 7
_ACKNOWLEDGE_BLOCK = 2


class _BlockUpload(UploadManager):  # type: ignore[misc]  # durand carries no types
    """Durand 0.5.0 says "7 bytes unused" where the last segment is full, and the client drops the segment."""

    def upload_sub_block(self, msg: bytes) -> None:
        """Take the client's message in a block upload."""
        if self._state is TransferState.BLOCK and msg[0] & 0x03 == _ACKNOWLEDGE_BLOCK and self._is_last(msg[1]):
            self._end(msg[1])
        else:
            super().upload_sub_block(msg)

    def _is_last(self, segments: int) -> bool:
        size = segments * _SEGMENT
        return len(self._stream.peek(size + 1)) <= size

    def _end(self, segments: int) -> None:
        data = self._stream.read(segments * _SEGMENT)
        crc = 0 if self._crc is None else crc_hqx(data, self._crc)
        unused = -len(data) % _SEGMENT
        response = bytes((0xC1 | unused << 2,)) + crc.to_bytes(2, "little") + bytes(5)
        self._server.node.network.send(self._server.cob_tx, response)
        self._state = TransferState.BLOCK_END


class SdoServer(SDOServer):  # type: ignore[misc]  # durand carries no types
    """The default SDO server of a node (1200h).

    Args:
        node: has `node_id`, `network`, `object_dictionary` and `nmt`.
    """

    def __init__(self, node: object) -> None:
        super().__init__(node)
        self.upload_manager = _BlockUpload(self)
        self._handle_cs_dict[2] = self._handle_cs_dict[5] = self.upload_manager.init_upload
        self._handle_cs_dict[3] = self.upload_manager.upload_segment

    def reset(self) -> None:
        """Forget any transfer in progress, as a reset of the node does."""
        self.download_manager._abort()
        self.upload_manager._abort()
