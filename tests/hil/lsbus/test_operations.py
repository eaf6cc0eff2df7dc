"""Bytes on the bus terminal are those of the standard's own macros, both ways."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from fmu.bus.description import TX_DATA
from fmu.compiling import HEADERS
from hil.lsbus.instance import BusFmuInstance
from hil.lsbus.operations import CanFrame, OpCode, baud_rate, frames, operations, transmit
from tests.hil.lsbus.stimuli import read

HERE = Path(__file__).parent
DATA = b"ABCDABCD"


@pytest.fixture(scope="module")
def vectors(need: Callable[[str], str], tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], list[str]]:
    """The program of the standard's macros: what it prints for an argument and an input."""
    program = tmp_path_factory.mktemp("vectors") / "vectors"
    include = ["-I", str(HERE / "headers"), "-I", str(HEADERS)]
    subprocess.run([need("gcc"), "-o", program, *include, HERE / "drivers" / "vectors.c"], check=True)

    def run(argument: str, given: str = "") -> list[str]:
        done = subprocess.run([program, argument], input=given, capture_output=True, text=True, check=True)
        return done.stdout.splitlines()

    return run


def bytes_of(lines: list[str]) -> list[bytes]:
    return [bytes.fromhex(line) for line in lines]


def test_frames_are_written_as_the_standard_writes_them(vectors: Callable[..., list[str]]) -> None:
    lowest, highest, short, remote = bytes_of(vectors("write"))[:4]
    assert transmit(CanFrame(0, DATA)) == lowest
    assert transmit(CanFrame(2**32 - 1, DATA, extended=True, remote=True)) == highest
    assert transmit(CanFrame(0x601, DATA[:3])) == short
    assert transmit(CanFrame(0x701, remote=True)) == remote
    assert list(frames(lowest + short)) == [CanFrame(0, DATA), CanFrame(0x601, DATA[:3])]


def test_every_operation_of_the_standard_is_taken_without_complaint(
    vectors: Callable[..., list[str]], bus_fmu: Path
) -> None:
    with BusFmuInstance(bus_fmu, {}) as instance:
        instance.take()
        for vector in bytes_of(vectors("write")):
            instance.give(vector)
            codes = [one.code for one in operations(instance.take())]
            assert OpCode.FORMAT_ERROR not in codes, vector.hex()


@pytest.mark.parametrize(
    "broken",
    [
        b"\x10",
        b"\x99\x00\x00\x00\x08\x00\x00\x00",
        b"\x10\x00\x00\x00\x08\x00\x00\x00",
        b"\x10\x00\x00\x00\xff\xff\xff\xff",
        transmit(CanFrame(0x601, bytes(8)))[:-1],
        transmit(CanFrame(0x601, bytes(9))),
        b"\x20\x00\x00\x00\x08\x00\x00\x00",
    ],
)
def test_what_is_no_operation_comes_back_as_a_format_error(broken: bytes, bus_fmu: Path) -> None:
    with BusFmuInstance(bus_fmu, {}) as instance:
        instance.take()
        instance.give(broken)
        (complaint,) = operations(instance.take())
    assert complaint.code == OpCode.FORMAT_ERROR
    assert complaint.content == len(broken).to_bytes(2, "little") + broken


def test_what_the_devices_send_the_standard_s_macros_read(vectors: Callable[..., list[str]], bus_fmu: Path) -> None:
    with BusFmuInstance(bus_fmu, {}) as instance:
        first = instance.take()
        instance.give(transmit(CanFrame(0x601, read(1, 0x1000).data)))
        second = instance.take()
    assert baud_rate(first) == 1_000_000
    told = vectors("read", first.hex())
    assert told == ["configuration 1 1000000", "configuration 4 1"] + [f"frame 70{n} 0 0 00" for n in range(1, 7)]
    assert vectors("read", second.hex()) == ["frame 581 0 0 4300100092010200"]


def test_what_nobody_takes_is_counted_and_what_was_taken_is_gone(bus_fmu: Path) -> None:
    with BusFmuInstance(bus_fmu, {}) as instance:
        assert TX_DATA in instance.names
        assert len(list(frames(instance.take()))) == 6
        assert instance.take() == b""
        for _ in range(600):
            instance.give(transmit(CanFrame(0x601, read(1, 0x1000).data)))
        assert instance.lost == 600 - 512
        assert len(list(frames(instance.take()))) == 512
