"""Messages of CAN_ISOTP: isotpsend and isotprecv of can-utils with each other, and by the frames of ISO 15765-2."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from hil.bus.socketcan import build_library, environment
from hil.bus.socketcan.library import compilers
from hil.bus.unix import UnixHub

PATIENCE = 30.0
TESTER, ECU = 0x7E0, 0x7E8
"""What the program sends under, and what it hears."""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not compilers():
        (pytest.fail if os.environ.get("QUASIOMNI_CI") else pytest.skip)("there is no C compiler")
    return build_library(tmp_path_factory.mktemp("cache"))


class Bench:
    """A hub, programs on it, and a hand that sends and hears frames."""

    def __init__(self, path: Path, library: Path) -> None:
        self.hub = UnixHub(path)
        self.environ = environment(os.environ, library, {"can0": path})
        self._programs: list[subprocess.Popen[str]] = []
        self._heard: deque[can.Message] = deque()

    def start(self, *command: str, message: str = "") -> subprocess.Popen[str]:
        """A program that the hub has seen."""
        known = self.hub.clients
        program = subprocess.Popen(
            command,
            env=self.environ,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._programs.append(program)
        assert program.stdin is not None
        program.stdin.write(message)
        program.stdin.close()
        program.stdin = None
        deadline = time.monotonic() + PATIENCE
        while self.hub.clients <= known and program.poll() is None:
            self._go_on(0.01)
            assert time.monotonic() < deadline
        return program

    def _go_on(self, duration: float) -> None:
        """The hub passes frames on as long as somebody listens to it."""
        message = self.hub.recv(duration)
        if message is not None:
            self._heard.append(message)

    def send(self, data: str, can_id: int = ECU) -> None:
        self.hub.send(can.Message(arbitration_id=can_id, data=bytes.fromhex(data), is_extended_id=False))

    def hear(self, can_id: int = TESTER) -> str:
        """The next frame of the program."""
        if not self._heard:
            self._go_on(PATIENCE)
        message = self._heard.popleft()
        assert message.arbitration_id == can_id
        return bytes(message.data).hex(" ")

    def silent(self, duration: float) -> bool:
        self._go_on(duration)
        return not self._heard

    def end(self, program: subprocess.Popen[str]) -> str:
        """What a program has said when it ends by itself; the hub goes on meanwhile."""
        deadline = time.monotonic() + PATIENCE
        while program.poll() is None:
            self._go_on(0.01)
            assert time.monotonic() < deadline
        return program.communicate()[0].strip()

    def close(self) -> None:
        for program in self._programs:
            program.kill()
            program.wait()
            assert program.stdout is not None
            program.stdout.close()
        self.hub.shutdown()


@pytest.fixture
def bench(tmp_path: Path, library: Path) -> Iterator[Bench]:
    for program in ("isotpsend", "isotprecv"):
        if shutil.which(program) is None:
            (pytest.fail if os.environ.get("QUASIOMNI_CI") else pytest.skip)(f"{program} is not installed")
    bench = Bench(tmp_path / "can0", library)
    yield bench
    bench.close()


def sender(bench: Bench, message: str, *options: str) -> subprocess.Popen[str]:
    return bench.start("isotpsend", "-s", f"{TESTER:X}", "-d", f"{ECU:X}", *options, "can0", message=message)


def receiver(bench: Bench, *options: str) -> subprocess.Popen[str]:
    return bench.start("isotprecv", "-s", f"{TESTER:X}", "-d", f"{ECU:X}", *options, "can0")


def numbers(count: int) -> str:
    return " ".join(f"{k & 0xFF:02X}" for k in range(count))


SIZES = (1, 7, 8, 13, 14, 62, 63, 200, 4095)
"""Around what fits into a frame, two frames, and a round of their numbers; the longest."""
WAYS = {"plain": ((), SIZES), "blocks": (("-b", "3", "-m", "1"), SIZES[:-1]), "padding": (("-p", "AA:55"), SIZES)}


@pytest.mark.parametrize(
    ("options", "size"),
    [pytest.param(way, size, id=f"{name}-{size}") for name, (way, sizes) in WAYS.items() for size in sizes],
)
def test_a_message_arrives_as_it_was_sent(bench: Bench, options: tuple[str, ...], size: int) -> None:
    padding = ("-p", "55:AA") if "-p" in options else ()
    receiving = bench.start("isotprecv", "-s", f"{ECU:X}", "-d", f"{TESTER:X}", *options, "can0")
    sending = sender(bench, numbers(size), *padding)
    assert bench.end(receiving) == numbers(size)
    bench.end(sending)
    assert sending.returncode == 0


def test_a_short_message_is_one_frame(bench: Bench) -> None:
    sending = sender(bench, "01 02 03")
    assert bench.hear() == "03 01 02 03"
    assert bench.end(sending) == ""


def test_padding_fills_every_frame(bench: Bench) -> None:
    sender(bench, numbers(9), "-p", "CC:")
    assert bench.hear() == "10 09 00 01 02 03 04 05"
    bench.send("30 00 00")
    assert bench.hear() == "21 06 07 08 cc cc cc cc"


def test_a_long_message_waits_for_the_flow_control_and_keeps_to_its_blocks(bench: Bench) -> None:
    sender(bench, numbers(27))
    assert bench.hear() == "10 1b 00 01 02 03 04 05"
    assert bench.silent(0.2)
    bench.send("30 02 00")
    assert [bench.hear(), bench.hear()] == ["21 06 07 08 09 0a 0b 0c", "22 0d 0e 0f 10 11 12 13"]
    assert bench.silent(0.2)
    bench.send("31 00 00")  # wait
    assert bench.silent(0.2)
    bench.send("30 00 00")
    assert bench.hear() == "23 14 15 16 17 18 19 1a"


def test_frames_come_no_closer_than_the_separation_time(bench: Bench) -> None:
    sender(bench, numbers(41))
    bench.hear()
    bench.send("30 00 28")  # 40 ms
    stamps = []
    for _ in range(5):
        bench.hear()
        stamps.append(time.monotonic())
    assert stamps[-1] - stamps[0] > 4 * 0.040 - 0.002


def test_the_number_of_frames_begins_again_after_fifteen(bench: Bench) -> None:
    sender(bench, numbers(6 + 7 * 17))
    bench.hear()
    bench.send("30 00 00")
    assert [int(bench.hear()[:2], 16) for _ in range(17)] == [0x20 | k % 16 for k in range(1, 18)]


@pytest.mark.parametrize(
    ("answer", "said"),
    [("32 00 00", "Message too long"), ("", "Communication error on send"), ("3f 00 00", "Bad message")],
)
def test_whoever_waits_for_the_end_is_told_what_failed(bench: Bench, answer: str, said: str) -> None:
    """Overflow, no flow control within a second, and one that ISO 15765-2 does not know."""
    sending = sender(bench, numbers(20), "-b")
    bench.hear()
    if answer:
        bench.send(answer)
    assert said in bench.end(sending)


def test_a_receiver_asks_for_blocks_and_puts_them_together(bench: Bench) -> None:
    receiving = receiver(bench, "-b", "2", "-m", "5")
    bench.send("10 1b 00 01 02 03 04 05")
    assert bench.hear() == "30 02 05"
    bench.send("21 06 07 08 09 0a 0b 0c")
    bench.send("22 0d 0e 0f 10 11 12 13")
    assert bench.hear() == "30 02 05"
    bench.send("23 14 15 16 17 18 19 1a")
    assert bench.end(receiving) == numbers(27)


INCOMPLETE = {
    "a frame is lost": ["10 14 00 01 02 03 04 05", "22 06 07 08 09 0a 0b 0c", "23 0d 0e 0f 10 11 12 13"],
    "a frame of nothing": [""],
    "a single frame without a length": ["00 01 02"],
    "a single frame that lies about its length": ["05 01 02"],
    "a first frame of what fits into one": ["10 05 00 01 02 03 04 05"],
    "a consecutive frame alone": ["21 01 02 03"],
    "a flow control alone": ["30 00 00"],
    "a message that is never finished": ["10 14 00 01 02 03 04 05"],
}


@pytest.mark.parametrize("frames", INCOMPLETE.values(), ids=INCOMPLETE)
def test_what_is_incomplete_is_dropped_and_the_next_message_arrives(bench: Bench, frames: list[str]) -> None:
    receiving = receiver(bench)
    for frame in frames:
        bench.send(frame)
    bench.send("02 AB CD")
    assert bench.end(receiving) == "AB CD"


def test_a_message_that_is_too_long_is_answered_by_an_overflow(bench: Bench) -> None:
    receiver(bench)
    bench.send("10 00 00 00 20 00 01 02")  # 8192 bytes, by the escape of ISO 15765-2:2016
    assert bench.hear()[:2] == "32"


def test_a_frame_that_is_not_padded_as_agreed_is_dropped(bench: Bench) -> None:
    receiving = receiver(bench, "-p", "55:55", "-P", "a")
    bench.send("02 11 22 AA AA AA AA AA")
    bench.send("02 33 44")
    bench.send("02 AB CD 55 55 55 55 55")
    assert bench.end(receiving) == "AB CD"


def test_others_frames_are_not_heard(bench: Bench) -> None:
    receiving = receiver(bench)
    bench.send("02 11 22", can_id=0x7E9)
    bench.send("02 AB CD")
    assert bench.end(receiving) == "AB CD"


SCRIPT = f"""
import errno, select, socket, struct
s = socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, 6)
def refused(call):
    try:
        call()
    except OSError as error:
        return errno.errorcode[error.errno]
print(refused(lambda: s.send(b'x')))
print(refused(lambda: s.setsockopt(106, 1, struct.pack('=IIBBBB', 0x002, 0, 0, 0, 0, 0))))
print(refused(lambda: s.setsockopt(106, 5, struct.pack('=BBB', 72, 64, 0))))
s.setsockopt(socket.SOL_SOCKET, 40, 1)  # SO_RXQ_OVFL
s.setsockopt(106, 2, struct.pack('=BBB', 4, 0, 0))
print(s.getsockopt(106, 2, 3).hex(), s.type == socket.SOCK_DGRAM, s.proto)
s.bind(('can0', {ECU}, {TESTER}))
print(refused(lambda: s.setsockopt(106, 2, struct.pack('=BBB', 4, 0, 0))))
print(refused(lambda: s.send(b'')), refused(lambda: s.send(bytes(4096))))
print(select.select([s], [s], [], 0.0)[0] == [], flush=True)
ready, _, _ = select.select([s], [], [], 30.0)
print(s.recvmsg(4095)[0].hex(' '))
print(s.recvfrom(4095))
"""


def test_a_socket_of_python_has_options_limits_and_select(bench: Bench) -> None:
    """Refused is what would be another protocol: extended addresses, CAN FD."""
    program = bench.start(sys.executable, "-c", SCRIPT)
    time.sleep(0.3)
    message = "10 10 00 01 02 03 01 05 06 07 08 09 0a 0b 0c 0d 0e 0f"
    bench.send(message[:23])
    assert bench.hear() == "30 04 00"
    bench.send("21 " + message[24:44])
    bench.send("22 " + message[45:])
    bench.send(message[:23])
    assert bench.hear() == "30 04 00"
    bench.send("21 " + message[24:44])
    bench.send("22 " + message[45:])
    said = bench.end(program).splitlines()
    names = [errno.errorcode[code] for code in (errno.EADDRNOTAVAIL, errno.EOPNOTSUPP, errno.EISCONN)]
    assert said[:3] == [names[0], names[1], names[1]]
    assert said[3:6] == ["040000 True 6", names[2], "EINVAL EMSGSIZE"]
    assert said[6] == "True"
    # Sixteen bytes, the size of a frame: none of them is taken for the mark of one, or cut off for a count of drops.
    assert said[7] == message[6:]
    assert said[8].startswith("(b'\\x00\\x01\\x02\\x03\\x01\\x05\\x06\\x07\\x08\\t\\n\\x0b\\x0c\\r\\x0e\\x0f', ('can0'")


def test_a_hub_that_ends_ends_the_waiting(bench: Bench) -> None:
    sending = sender(bench, numbers(20), "-b")
    bench.hear()
    bench.hub.shutdown()
    assert "Network is down" in sending.communicate(timeout=PATIENCE)[0]
