"""What happens to files: bits flip, ends are cut off, blocks are lost, doubled, swapped or zeroed, lengths lie."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping

import numpy as np

Rng = np.random.Generator
Damage = Callable[[bytes, Rng], bytes]

HEADER = 512


def _place(content: bytes, rng: Rng, size: int = 1) -> int:
    return int(rng.integers(0, max(len(content) - size, 1)))


def _block(content: bytes, rng: Rng) -> slice:
    size = int(rng.integers(1, max(min(len(content) // 3, 4096), 2)))
    start = _place(content, rng, size)
    return slice(start, start + size)


def flip_bit(content: bytes, rng: Rng) -> bytes:
    damaged = bytearray(content)
    damaged[_place(content, rng)] ^= 1 << int(rng.integers(8))
    return bytes(damaged)


def flip_bits(content: bytes, rng: Rng) -> bytes:
    for _ in range(int(rng.integers(2, 40))):
        content = flip_bit(content, rng)
    return content


def cut_end(content: bytes, rng: Rng) -> bytes:
    return content[: _place(content, rng)]


def cut_last_bytes(content: bytes, rng: Rng) -> bytes:
    return content[: -int(rng.integers(1, 64))]


def cut_start(content: bytes, rng: Rng) -> bytes:
    return content[_place(content, rng) :]


def remove_block(content: bytes, rng: Rng) -> bytes:
    block = _block(content, rng)
    return content[: block.start] + content[block.stop :]


def double_block(content: bytes, rng: Rng) -> bytes:
    block = _block(content, rng)
    return content[: block.stop] + content[block.start :]


def swap_blocks(content: bytes, rng: Rng) -> bytes:
    block = _block(content, rng)
    size = block.stop - block.start
    other = _place(content, rng, size)
    damaged = bytearray(content)
    damaged[block], damaged[other : other + size] = content[other : other + size], content[block]
    return bytes(damaged)


def zero_range(content: bytes, rng: Rng) -> bytes:
    block = _block(content, rng)
    return content[: block.start] + bytes(block.stop - block.start) + content[block.stop :]


def overwrite_range(content: bytes, rng: Rng) -> bytes:
    block = _block(content, rng)
    return content[: block.start] + rng.bytes(block.stop - block.start) + content[block.stop :]


def insert_bytes(content: bytes, rng: Rng) -> bytes:
    place = _place(content, rng)
    return content[:place] + rng.bytes(int(rng.integers(1, 200))) + content[place:]


def wrong_length(content: bytes, rng: Rng) -> bytes:
    """An integer of 4 or 8 bytes, small as lengths and counts are, is another one."""
    size = int(rng.choice([4, 8]))
    for _ in range(200):
        place = _place(content, rng, size) & ~3
        value = int.from_bytes(content[place : place + size], "little")
        if 0 < value < 1 << 24:
            break
    others = [0, 1, value - 1, value + 1, 2 * value, 2 ** (8 * size) - 1, 2 ** (8 * size - 1), 1 << 30]
    new = int(others[int(rng.integers(len(others)))]) % 2 ** (8 * size)
    return content[:place] + new.to_bytes(size, "little") + content[place + size :]


def edit_header(content: bytes, rng: Rng) -> bytes:
    damaged = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        damaged[int(rng.integers(min(HEADER, len(content))))] = int(rng.integers(256))
    return bytes(damaged)


def lose_line(content: bytes, rng: Rng) -> bytes:
    lines = content.split(b"\n")
    del lines[int(rng.integers(len(lines)))]
    return b"\n".join(lines)


def swap_lines(content: bytes, rng: Rng) -> bytes:
    lines = content.split(b"\n")
    one, other = rng.integers(len(lines), size=2)
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def join_lines(content: bytes, rng: Rng) -> bytes:
    lines = content.split(b"\n")
    place = int(rng.integers(max(len(lines) - 1, 1)))
    return b"\n".join([*lines[:place], b"".join(lines[place : place + 2]), *lines[place + 2 :]])


ODD_VALUES = (
    b"nan", b"inf", b"-1", b"0", b"1e308", b"true", b'"x"', b"[]", b"{}", b"9" * 5000, b"[" * 3000, b"\xff\xfe", b"",
    b'"\\u0000"', b'"[/red]"', b"1979-05-27",
)  # fmt: skip


def other_value(content: bytes, rng: Rng) -> bytes:
    """What stands behind an equals sign, a colon or a comma is something else."""
    places = [number for number, byte in enumerate(content) if byte in b"=:,"]
    if not places:
        return flip_bit(content, rng)
    start = places[int(rng.integers(len(places)))] + 1
    end = start
    while end < len(content) and content[end] not in b",}]\n":
        end += 1
    return content[:start] + b" " + ODD_VALUES[int(rng.integers(len(ODD_VALUES)))] + content[end:]


BINARY: Mapping[str, Damage] = {
    function.__name__: function
    for function in (
        flip_bit, flip_bits, cut_end, cut_last_bytes, cut_start, remove_block, double_block, swap_blocks, zero_range,
        overwrite_range, insert_bytes, wrong_length, edit_header,
    )
}  # fmt: skip
TEXT: Mapping[str, Damage] = {
    **{name: damage for name, damage in BINARY.items() if name not in ("wrong_length", "overwrite_range")},
    **{function.__name__: function for function in (lose_line, swap_lines, join_lines, other_value)},
}

_CONTAINER = struct.Struct("<4sHHLLH6xL4x")
"""A log container of a BLF file: signature, header size and version, size, type, method, unpacked size."""
_BLF_HEADER = 144


def _container(body: bytes, method: int, unpacked: int, size: int | None = None) -> bytes:
    size = _CONTAINER.size + len(body) if size is None else size
    return _CONTAINER.pack(b"LOBJ", 16, 1, size, 10, method, unpacked) + body + bytes(size % 4)


def _with_file_size(content: bytes) -> bytes:
    """The size in the header set right, so that it is not what gives the damage away."""
    return content[:16] + len(content).to_bytes(8, "little") + content[24:]


def _hand_made(middle: bytes) -> Damage:
    """Something between the header and the first container of a file."""
    return lambda content, _: _with_file_size(content[:_BLF_HEADER] + middle + content[_BLF_HEADER:])


def _unpacked(content: bytes) -> bytes:
    position, parts = _BLF_HEADER, []
    while position < len(content):
        _, _, _, size, _, method, _ = _CONTAINER.unpack_from(content, position)
        body = content[position + _CONTAINER.size : position + size]
        parts.append(zlib.decompress(body) if method == 2 else body)
        position += size + size % 4
    return b"".join(parts)


def _rebuilt(change: Callable[[bytes], bytes], count: int | None = None) -> Damage:
    """The objects of a file changed and packed into one container again, header right but for the count of objects."""

    def rebuild(content: bytes, _: Rng) -> bytes:
        objects = change(_unpacked(content))
        head = content[:_BLF_HEADER] if count is None else content[:32] + struct.pack("<L", count) + content[36:144]
        return _with_file_size(head + _container(zlib.compress(objects), 2, len(objects)))

    return rebuild


def _bomb(size: int) -> bytes:
    packer = zlib.compressobj(1)
    zeros = bytes(1 << 20)
    return b"".join([*(packer.compress(zeros) for _ in range(size >> 20)), packer.flush()])


def _later(objects: bytes) -> bytes:
    """The stamps of the second half are a year later."""
    frames = bytearray(objects)
    for start in range(len(objects) // 96 * 48, len(objects), 48):
        (stamp,) = struct.unpack_from("<Q", objects, start + 24)
        struct.pack_into("<Q", frames, start + 24, stamp + 365 * 86400 * 10**9)
    return bytes(frames)


def hand_made_blf() -> Mapping[str, Damage]:
    """Files that no accident makes, and somebody might."""
    bomb = _bomb(600 << 20)
    return {
        "container of size 0": _hand_made(_container(b"", 0, 0, size=0)),
        "container smaller than its header": _hand_made(_container(b"", 0, 0, size=20)),
        "containers with nothing in them": _hand_made(_container(b"", 0, 0) * 5000),
        "container of nothing, packed": _hand_made(_container(zlib.compress(b""), 2, 0)),
        "packed by an unknown method": _hand_made(_container(b"x" * 64, 7, 64)),
        "bomb that says its size": _hand_made(_container(bomb, 2, 600 << 20)),
        "bomb that says another size": _hand_made(_container(bomb, 2, 48)),
        "bombs below the limit, many": _hand_made(_container(bomb[: len(bomb) // 2], 2, 300 << 20) * 3),
        "size of 4 GiB": _hand_made(_container(b"", 0, 0, size=2**32 - 4)[:64]),
        "no container": _hand_made(b"LOBJ" + bytes(28)),
        "object of size 0": _rebuilt(lambda objects: objects[:8] + bytes(4) + objects[12:]),
        "object beyond the end": _rebuilt(lambda objects: objects[:8] + b"\xff\xff\xff\x7f" + objects[12:]),
        "object cut off": _rebuilt(lambda objects: objects[:-10]),
        "an object less": _rebuilt(lambda objects: objects[48:]),
        "count of objects 0": _rebuilt(lambda objects: objects, count=0),
        "marker instead of a frame": _rebuilt(lambda objects: objects[:12] + struct.pack("<L", 96) + objects[16:]),
        "frame of an unknown version": _rebuilt(lambda objects: objects[:6] + b"\x09\x00" + objects[8:]),
        "stamps of an unknown unit": _rebuilt(lambda objects: objects[:16] + b"\x07\x00\x00\x00" + objects[20:]),
        "error frame short of bytes": _rebuilt(lambda objects: objects[:12] + struct.pack("<L", 73) + objects[16:]),
        "objects in reverse": _rebuilt(
            lambda objects: b"".join(objects[start : start + 48] for start in range(len(objects) - 48, -48, -48))
        ),
        "a gap of a year": _rebuilt(_later),
    }
