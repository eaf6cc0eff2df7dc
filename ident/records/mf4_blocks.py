"""The blocks of an ASAM MDF 4 file, looked at before a library reads them: all there, no circle, and of bounded size.

asammdf takes what the blocks say of themselves at their word: it allocates what a count asks for, unpacks whatever a
block unpacks to, and follows links for ever where they lead back. Layout after ASAM MDF 4.2.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ident.errors import RecordError
from ident.reading import LARGEST_RECORD, read_bounded

_FIRST = 64
"""Address of the header block; the identification block is before it."""
_HEAD = struct.Struct("<4sIQQ")
_DATA_GROUP = struct.Struct("<B")
_CHANNEL_GROUP = struct.Struct("<QQHH4xII")
_PACKED = struct.Struct("<2sBBIQQ")

_FOLLOWED: Final = {
    b"##HD": 6,
    b"##DG": 4,
    b"##CG": 6,
    b"##CN": 8,
    b"##CC": 1000,
    b"##CA": 1,
    b"##SI": 3,
    b"##HL": 1,
    b"##DL": 1 << 24,
    b"##FH": 2,
    b"##AT": 1,
    b"##EV": 1,
    b"##CH": 1,
}
"""Links, from the first one on, that lead down or on; those behind them may lead back to what they belong to."""
_CHANNEL, _CHANNEL_DATA = b"##CN", 5
_PLAIN_DATA: Final = (b"##DT", b"##SD", b"##RD", b"##DV", b"##DI")
_ANY_LENGTH = 0x1
"""Flag of a channel group whose size is not given by its count."""
_DEFLATED = (0, 1)
_CHUNK = 1 << 16


@dataclass(frozen=True)
class _Block:
    kind: bytes
    address: int
    length: int
    links: tuple[int, ...]

    @property
    def name(self) -> str:
        return f"{self.kind[2:].decode()} block at byte {self.address}"

    @property
    def body(self) -> int:
        """Where its data begin, behind the links."""
        return self.address + _HEAD.size + 8 * len(self.links)


def check_blocks(path: Path) -> None:
    """See that every block of a file is inside of it, that links end, and that data are as long as their counts say.

    Raises:
        RecordError: with the block and its place; also where the file is too large, as it is or unpacked.
    """
    content = read_bounded(path, LARGEST_RECORD, RecordError)
    _check_identification(content, path)
    try:
        blocks = _walk(content)
        sizes = {block.address: _data_size(content, block) for block in blocks.values()}
        for group in blocks.values():
            if group.kind == b"##DG":
                _check_counts(content, group, blocks, sizes)
    except (struct.error, ValueError) as error:
        raise RecordError(f"{path} is damaged or cut off: {error}.", "Record again, or use another copy.") from error
    if sum(sizes.values()) > LARGEST_RECORD:
        raise RecordError(f"{path} unpacks to more than {LARGEST_RECORD} bytes.", "Split the record.")
    for block in blocks.values():
        if block.kind == b"##DZ":
            _check_packed(content, block, path)


def _check_identification(content: bytes, path: Path) -> None:
    if content[:8] == b"UnFinMF ":
        raise RecordError(
            f"{path} was not finished by what wrote it.", "Finalise it with a tool of its maker, or record again."
        )
    if content[:8] != b"MDF     " or len(content) < _FIRST:
        raise RecordError(f"{path} is damaged: it does not begin as an MDF file.", "Record again.")
    (version,) = struct.unpack_from("<H", content, 28)
    if not 400 <= version < 500:
        raise RecordError(f"{path} is of MDF version {version / 100:.2f}.", "Convert it to MDF 4.")


def _walk(content: bytes) -> dict[int, _Block]:
    """All blocks by address, depth first without recursion; a link back to a block that is not finished is a circle."""
    blocks: dict[int, _Block] = {}
    root = _block(content, _FIRST)
    open_blocks = {_FIRST}
    blocks[_FIRST] = root
    waiting = [(root, _targets(content, root))]
    while waiting:
        block, targets = waiting[-1]
        address = next(targets, None)
        if address is None:
            open_blocks.discard(block.address)
            waiting.pop()
        elif address in open_blocks:
            raise ValueError(f"the {block.name} leads back to byte {address}")
        elif address not in blocks:
            blocks[address] = found = _block(content, address)
            open_blocks.add(address)
            waiting.append((found, _targets(content, found)))
    return blocks


def _targets(content: bytes, block: _Block) -> Iterator[int]:
    for number, address in enumerate(block.links[: _FOLLOWED.get(block.kind, 0)]):
        # The data of a channel may be another channel, that of its length, which stands before or behind it.
        sibling = block.kind == _CHANNEL and number == _CHANNEL_DATA and content[address : address + 4] == _CHANNEL
        if address and not sibling:
            yield address


def _block(content: bytes, address: int) -> _Block:
    if address + _HEAD.size > len(content):
        raise ValueError(f"a block should be at byte {address}, and the file has {len(content)} bytes")
    kind, _, length, count = _HEAD.unpack_from(content, address)
    if kind[:2] != b"##" or not kind[2:].isalnum():
        raise ValueError(f"no block at byte {address}, where one should be")
    if address + length > len(content):
        raise ValueError(
            f"the {kind[2:].decode()} block at byte {address} ends at byte {address + length} of {len(content)}"
        )
    if length < _HEAD.size + 8 * count:
        raise ValueError(f"the {kind[2:].decode()} block at byte {address} has {length} bytes and {count} links")
    return _Block(kind, address, length, struct.unpack_from(f"<{count}Q", content, address + _HEAD.size))


def _data_size(content: bytes, block: _Block) -> int:
    """Bytes of samples in a block, unpacked; 0 in blocks of other kinds."""
    if block.kind in _PLAIN_DATA:
        return block.length - _HEAD.size
    if block.kind == b"##DZ":
        return int(_PACKED.unpack_from(content, block.body)[4])
    return 0


def _check_counts(content: bytes, group: _Block, blocks: dict[int, _Block], sizes: dict[int, int]) -> None:
    _, first, data, _ = group.links[:4]
    if data and blocks[data].kind == b"##LD":
        return
    (identifier,) = _DATA_GROUP.unpack_from(content, group.body)
    expected = 0
    for channels in _chain(first, blocks):
        _, cycles, flags, _, size, invalidation = _CHANNEL_GROUP.unpack_from(content, channels.body)
        if flags & _ANY_LENGTH:
            return
        expected += cycles * (identifier + size + invalidation)
    there = sum(sizes[block.address] for block in _lists(data, blocks))
    if expected != there:
        raise ValueError(f"the {group.name} tells of {expected} bytes of samples, and {there} are there")


def _lists(address: int, blocks: dict[int, _Block]) -> Iterator[_Block]:
    """Data blocks behind a link: one, or those of a chain of lists."""
    if address and blocks[address].kind == b"##HL":
        address = blocks[address].links[0]
    if address and blocks[address].kind != b"##DL":
        yield blocks[address]
        return
    for entry in _chain(address, blocks):
        yield from (blocks[link] for link in entry.links[1:] if link)


def _chain(address: int, blocks: dict[int, _Block]) -> Iterator[_Block]:
    while address:
        yield blocks[address]
        address = blocks[address].links[0]


def _check_packed(content: bytes, block: _Block, path: Path) -> None:
    """Unpack a block in small pieces, keeping none: it must give what it says, and no more."""
    _, method, _, _, size, packed = _PACKED.unpack_from(content, block.body)
    if method % 256 not in _DEFLATED:
        return
    start = block.body + _PACKED.size
    unpacker, found = zlib.decompressobj(), 0
    rest = bytes(content[start : start + packed])
    try:
        while rest and not unpacker.eof and found <= size:
            found += len(unpacker.decompress(rest, _CHUNK))
            rest = unpacker.unconsumed_tail
    except zlib.error as error:
        raise RecordError(
            f"{path} is damaged: the {block.name} cannot be unpacked ({error}).", "Record again."
        ) from error
    if found != size or not unpacker.eof:
        raise RecordError(
            f"{path} is damaged: the {block.name} does not unpack to the {size} bytes that it states.", "Record again."
        )
