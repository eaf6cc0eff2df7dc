"""Programs written for SocketCAN, as they come from Debian and PyPI, on the bus between processes."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import shutil
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.serving import VehicleServer
from hil.bus.clock import WallClock
from hil.bus.socketcan import build_library, environment
from hil.bus.socketcan.library import compilers
from hil.bus.unix import UnixBus, UnixHub
from ident.errors import BusError

PATIENCE = 30.0
"""For a program to start and answer on a busy machine [s]."""


def needs(program: str) -> None:
    """Skip where a system program is missing; in CI that is a failure."""
    if shutil.which(program) is None:
        message = f"{program} is not installed (Debian: can-utils, gcc)"
        if os.environ.get("QUASIOMNI_CI"):
            pytest.fail(message)
        pytest.skip(message)


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not compilers():
        needs("gcc")
    return build_library(tmp_path_factory.mktemp("cache"))


class Served:
    """Emulated nodes on a hub in a thread of their own, and programs beside them."""

    def __init__(self, path: Path, library: Path) -> None:
        self.path = path
        self.library = library
        self.interfaces = {"can0": path}
        self.environ = environment(os.environ, library, self.interfaces)
        self.hub = UnixHub(path)
        self.server = VehicleServer(Flywheels(), self.hub, WallClock())
        self._done = threading.Event()
        self._thread = threading.Thread(target=self.server.serve, args=(self._done.is_set,))
        self._thread.start()

    def add(self, name: str, path: Path) -> None:
        """Another interface for the programs to come."""
        self.interfaces[name] = path
        self.environ = environment(os.environ, self.library, self.interfaces)

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(command, env=self.environ, capture_output=True, text=True, timeout=PATIENCE, check=False)

    def start(self, *command: str) -> subprocess.Popen[str]:
        return subprocess.Popen(command, env=self.environ, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def close(self) -> None:
        self._done.set()
        self._thread.join()
        self.hub.shutdown()


@pytest.fixture
def served(tmp_path: Path, library: Path) -> Iterator[Served]:
    served = Served(tmp_path / "can0", library)
    yield served
    served.close()


def listening(served: Served, *arguments: str) -> subprocess.Popen[str]:
    """A candump that has been seen to hear the bus."""
    needs("candump")
    known = served.hub.clients
    process = served.start("candump", *arguments)
    deadline = time.monotonic() + PATIENCE
    while served.hub.clients <= known:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return process


def test_candump_shows_what_cansend_sends_and_what_the_nodes_answer(served: Served) -> None:
    dump = listening(served, "-n", "3", "-L", "can0")
    assert served.run("cansend", "can0", "601#4000100000000000").returncode == 0
    assert served.run("cansend", "can0", "000#8102").returncode == 0
    lines = [re.sub(r"^\(\d+\.\d{6}\) ", "", line) for line in dump.communicate(timeout=PATIENCE)[0].splitlines()]
    assert lines == ["can0 601#4000100000000000", "can0 581#4300100092010200", "can0 000#8102"]


def test_candump_stamps_frames_with_the_time_of_the_clock(served: Served) -> None:
    dump = listening(served, "-n", "1", "-L", "can0")
    before = time.time()
    served.run("cansend", "can0", "123#00")
    stamp = float(dump.communicate(timeout=PATIENCE)[0].split(")")[0].lstrip("("))
    assert before <= stamp <= time.time()


FILTERS = {
    "one identifier": ("can0,581:7FF", ["581"]),
    "a range of identifiers": ("can0,580:780", ["581", "582"]),
    "everything but one": ("can0,601~7FF", ["581", "602", "582"]),
    "any interface": ("any,582:7FF", ["582"]),
}


@pytest.mark.parametrize(("selection", "heard"), FILTERS.values(), ids=FILTERS)
def test_filters_of_candump_let_through_what_they_say(served: Served, selection: str, heard: list[str]) -> None:
    dump = listening(served, "-n", str(len(heard)), "-L", selection)
    for node in (1, 2):
        served.run("cansend", "can0", f"60{node}#4000100000000000")
    lines = dump.communicate(timeout=PATIENCE)[0].splitlines()
    assert [line.split()[2].split("#")[0] for line in lines] == heard


def test_extended_and_remote_frames_pass_in_both_directions(served: Served) -> None:
    dump = listening(served, "-n", "2", "-L", "can0")
    bus = UnixBus(served.path)
    served.run("cansend", "can0", "1ABCDEF0#0102")
    served.run("cansend", "can0", "701#R1")
    received = [message for _ in range(2) if (message := bus.recv(PATIENCE)) is not None]
    bus.shutdown()
    assert [(one.arbitration_id, one.is_extended_id, one.is_remote_frame) for one in received] == [
        (0x1ABCDEF0, True, False),
        (0x701, False, True),
    ]
    assert [line.split()[2] for line in dump.communicate(timeout=PATIENCE)[0].splitlines()] == [
        "1ABCDEF0#0102",
        "701#R1",
    ]


def test_error_frames_reach_only_those_who_asked_for_them(served: Served) -> None:
    deaf = listening(served, "-n", "1", "-L", "can0")
    keen = listening(served, "-n", "1", "-e", "can0,0:0,#FFFFFFFF")
    served.server.faults.add("bus_off@encoder_left")
    served.run("cansend", "can0", "123#")
    assert "20000008" in keen.communicate(timeout=PATIENCE)[0]
    assert "123#" in deaf.communicate(timeout=PATIENCE)[0]


def test_a_thousand_frames_of_cangen_arrive_whole_and_in_order(served: Served) -> None:
    needs("cangen")
    with UnixBus(served.path) as bus:
        sender = served.start("cangen", "can0", "-g", "0", "-n", "1000", "-I", "555", "-L", "8", "-D", "i")
        received = [message for _ in range(1000) if (message := bus.recv(PATIENCE)) is not None]
        sender.wait(PATIENCE)
    counters = [int.from_bytes(message.data, "little") for message in received]
    assert counters == list(range(1000))


def hear(dump: subprocess.Popen[str], lines: list[str]) -> None:
    for line in dump.stdout or ():
        lines.append(line)


def test_candump_that_was_stopped_counts_the_frames_that_it_has_lost(served: Served) -> None:
    """candump -d asks for SO_RXQ_OVFL: the system counts what the receive queue of a socket had no room for."""
    dump = listening(served, "-d", "-L", "can0,555:7FF")
    dump.send_signal(signal.SIGSTOP)
    with UnixBus(served.path) as bus:
        for number in range(20_000):
            bus.send(can.Message(arbitration_id=0x555, is_extended_id=False, data=number.to_bytes(4, "little")))
        deadline = time.monotonic() + PATIENCE
        while not (report := served.hub.listeners[0]).dropped or report.dropped + report.waiting < 10_000:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        assert report.pid == dump.pid
        # The nodes were served meanwhile.
        assert served.run("cansend", "can0", "601#4000100000000000").returncode == 0
        heard: list[str] = []
        reader = threading.Thread(target=hear, args=(dump, heard), daemon=True)
        reader.start()
        dump.send_signal(signal.SIGCONT)
        while served.hub.listeners[0].waiting:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        lost = served.hub.listeners[0].dropped
        bus.send(can.Message(arbitration_id=0x555, is_extended_id=False, data=b"last"))
        while not (heard and heard[-1].endswith("555#6C617374\n")):
            assert time.monotonic() < deadline
            time.sleep(0.01)
    dump.kill()
    reader.join()
    told = [line for line in heard if "DROPCOUNT" in line]
    assert f"total drops {lost})" in told[-1]
    assert heard[0].endswith("555#00000000\n")


PYTHON_CAN = """
import can, time
bus = can.Bus(interface="socketcan", channel="can0", receive_own_messages=True, can_filters=[
    {"can_id": 0x580, "can_mask": 0x780}, {"can_id": 0x601, "can_mask": 0x7FF}])
bus.send(can.Message(arbitration_id=0x123, is_extended_id=False))
bus.send(can.Message(arbitration_id=0x601, data=bytes.fromhex("4000100000000000"), is_extended_id=False))
before = time.time()
for _ in range(2):
    message = bus.recv(20.0)
    assert abs(message.timestamp - before) < 20.0 and message.channel == "can0"
    print(f"{message.arbitration_id:03X}", message.is_rx, bytes(message.data).hex())
assert bus.recv(0.1) is None
bus.set_filters([{"can_id": 0x123, "can_mask": 0x7FF}])
bus.send(can.Message(arbitration_id=0x123, is_extended_id=False))
print(f"{bus.recv(20.0).arbitration_id:03X}", bus.filters)
bus.shutdown()
"""


def test_python_cans_own_socketcan_interface_sends_receives_and_filters(served: Served) -> None:
    done = served.run(sys.executable, "-c", PYTHON_CAN)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "601 False 4000100000000000",
        "581 True 4300100092010200",
        "123 [{'can_id': 291, 'can_mask': 2047}]",
    ]


CANOPEN_MASTER = """
import canopen, time
network = canopen.Network()
network.connect(interface="socketcan", channel="can0")
network.scanner.search(limit=8)
time.sleep(1.0)
print(sorted(network.scanner.nodes))
node = network.add_node(1, canopen.ObjectDictionary())
print(node.sdo.upload(0x1008, 0).decode())
network.disconnect()
"""


def test_python_canopen_finds_and_reads_the_nodes_over_socketcan(served: Served) -> None:
    done = served.run(sys.executable, "-c", CANOPEN_MASTER)
    assert done.returncode == 0, done.stderr
    nodes, name = done.stdout.splitlines()
    assert nodes == "[1, 2, 3, 4, 5, 6]"
    assert name


PERIODIC = """
import can, time
bus = can.Bus(interface="socketcan", channel="can0")
message = can.Message(arbitration_id=0x555, data=[1], is_extended_id=False)
task = bus.send_periodic(message, 0.02)
time.sleep(1.0)
message.data = bytearray([2])
task.modify_data(message)
time.sleep(1.0)
task.stop()
time.sleep(0.3)
bus.send(can.Message(arbitration_id=0x556, is_extended_id=False))
limited = bus.send_periodic(can.Message(arbitration_id=0x557, is_extended_id=False), 0.01, duration=0.1)
time.sleep(1.0)
bus.send(can.Message(arbitration_id=0x558, is_extended_id=False))
bus.shutdown()
"""


def test_python_cans_periodic_messages_are_sent_by_the_broadcast_manager(served: Served) -> None:
    with UnixBus(served.path) as bus:
        running = served.start(sys.executable, "-c", PERIODIC)
        received: list[can.Message] = []
        while not received or received[-1].arbitration_id != 0x558:
            message = bus.recv(PATIENCE)
            assert message is not None, running.communicate()
            received.append(message)
        running.wait(PATIENCE)
    by_id = {can_id: [one for one in received if one.arbitration_id == can_id] for can_id in (0x555, 0x556, 0x557)}
    first, second = ([one for one in by_id[0x555] if one.data[0] == number] for number in (1, 2))
    # One second each at 20 ms; a busy machine may sleep over some.
    assert 35 <= len(first) <= 52
    assert 35 <= len(second) <= 52
    assert by_id[0x555][-1].timestamp < by_id[0x556][0].timestamp - 0.2
    # python-can asks for duration / period = 10 frames, and announces the first.
    assert len(by_id[0x557]) in (10, 11)


CANOPEN_SYNC = """
import canopen, time
network = canopen.Network()
network.connect(interface="socketcan", channel="can0")
node = network.add_node(1, canopen.ObjectDictionary())
node.sdo.download(0x1800, 2, b"\\x01")
node.nmt.state = "OPERATIONAL"
answers = []
network.subscribe(0x181, lambda *arguments: answers.append(arguments))
network.sync.start(0.02)
time.sleep(1.0)
network.sync.stop()
time.sleep(0.3)
settled = len(answers)
time.sleep(0.3)
network.disconnect()
print(settled, len(answers) - settled)
"""


def test_python_canopens_own_sync_producer_drives_the_nodes(served: Served) -> None:
    done = served.run(sys.executable, "-c", CANOPEN_SYNC)
    assert done.returncode == 0, done.stderr
    answers, afterwards = (int(word) for word in done.stdout.split())
    assert 35 <= answers <= 52
    assert afterwards == 0


C_PROGRAM = """
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>
int main(void) {
    int s = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    struct ifreq request;
    strcpy(request.ifr_name, "can0");
    if (s < 0 || ioctl(s, SIOCGIFINDEX, &request) < 0) return 1;
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = request.ifr_ifindex}, name = {0};
    if (bind(s, (struct sockaddr *)&address, sizeof address) < 0) return 2;
    socklen_t size = sizeof name;
    if (getsockname(s, (struct sockaddr *)&name, &size) < 0 || name.can_ifindex != address.can_ifindex) return 3;
    if (if_nametoindex("can0") != (unsigned)request.ifr_ifindex) return 4;
    struct can_frame frame = {.can_id = 0x602, .can_dlc = 8, .data = {0x40, 0x00, 0x10}};
    if (write(s, &frame, sizeof frame) != sizeof frame) return 5;
    struct pollfd waiting = {.fd = s, .events = POLLIN};
    if (poll(&waiting, 1, 20000) != 1 || read(s, &frame, sizeof frame) != sizeof frame) return 6;
    printf("%03X %d %02X%02X\\n", frame.can_id, frame.can_dlc, frame.data[4], frame.data[5]);
    strcpy(request.ifr_name, "can7");
    return ioctl(s, SIOCGIFINDEX, &request) == 0 ? 7 : close(s);
}
"""


def test_a_master_written_in_c_runs_as_it_was_compiled(served: Served, tmp_path: Path) -> None:
    needs("gcc")
    source, program = tmp_path / "master.c", tmp_path / "master"
    source.write_text(C_PROGRAM)
    subprocess.run(["gcc", str(source), "-o", str(program)], check=True)
    done = served.run(str(program))
    assert (done.returncode, done.stdout) == (0, "582 8 9201\n")


EVERY_CALL = """
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/if_packet.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>
static struct can_frame frame = {.can_id = 0x555, .can_dlc = 1};
static void said(const char *what, long result) {
    printf("%s %ld %s\\n", what, result, result < 0 ? strerrorname_np(errno) : "");
}
static int bound(const char *name) {
    int s = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = if_nametoindex(name)};
    return bind(s, (struct sockaddr *)&address, sizeof address) ? -1 : s;
}
static void sizes(void) {
    int s = bound("can0");
    struct can_frame long_frame = {.can_id = 0x555, .can_dlc = 9};
    struct canfd_frame fd_frame = {.can_id = 0x555, .len = 12};
    struct iovec parts[2] = {{&frame, 8}, {(char *)&frame + 8, 8}};
    struct msghdr message = {.msg_iov = parts, .msg_iovlen = 2};
    said("frame", write(s, &frame, sizeof frame));
    said("short", write(s, &frame, 15));
    said("nothing", send(s, &frame, 0, 0));
    said("dlc 9", write(s, &long_frame, sizeof long_frame));
    said("fd frame", send(s, &fd_frame, sizeof fd_frame, 0));
    said("in parts", writev(s, parts, 2));
    said("one part", writev(s, parts, 1));
    said("message", sendmsg(s, &message, 0));
    close(s);
    said("unbound", write(socket(PF_CAN, SOCK_RAW, CAN_RAW), &frame, sizeof frame));
}
static void addresses(void) {
    int s = bound("can0"), free_one = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    struct sockaddr_can other = {.can_family = AF_CAN, .can_ifindex = if_nametoindex("can1")}, nobody = other;
    nobody.can_ifindex = 4711;
    frame.can_id = 0x556;
    said("to another", sendto(s, &frame, sizeof frame, 0, (struct sockaddr *)&other, sizeof other));
    said("from unbound", sendto(free_one, &frame, sizeof frame, 0, (struct sockaddr *)&other, sizeof other));
    said("to nobody", sendto(s, &frame, sizeof frame, 0, (struct sockaddr *)&nobody, sizeof nobody));
}
static void duplicates(void) {
    int s = bound("can0"), copies[3] = {dup(s), dup2(s, 77), fcntl(s, F_DUPFD_CLOEXEC, 90)};
    struct can_filter filter = {.can_id = 0x123, .can_mask = 0x7FF};
    struct sockaddr_can name = {0};
    socklen_t size = sizeof name;
    close(s);
    for (int k = 0; k < 3; k++) {
        said("option", setsockopt(copies[k], SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof filter));
        said("name", getsockname(copies[k], (struct sockaddr *)&name, &size) ? -1 : name.can_family == AF_CAN);
        said("length", write(copies[k], &frame, 3));
        close(copies[k]);
    }
    said("closed", setsockopt(copies[0], SOL_CAN_RAW, CAN_RAW_FILTER, &filter, sizeof filter));
    int pipes[2];
    said("pipe", pipe(pipes));
    said("other", write(pipes[1], "abc", 3));
}
static void interfaces(void) {
    struct ifaddrs *list, *second;
    struct if_nameindex *names = if_nameindex();
    if (getifaddrs(&list) || getifaddrs(&second)) return;
    for (struct ifaddrs *one = list; one; one = one->ifa_next)
        if (strncmp(one->ifa_name, "can", 3) == 0) {
            struct sockaddr_ll *link = (struct sockaddr_ll *)one->ifa_addr;
            printf("%s %d %d\\n", one->ifa_name, link->sll_hatype == ARPHRD_CAN, (one->ifa_flags & IFF_UP) != 0);
        }
    freeifaddrs(list);
    freeifaddrs(second);
    for (struct if_nameindex *one = names; one->if_name; one++)
        if (strncmp(one->if_name, "can", 3) == 0 || strcmp(one->if_name, "lo") == 0) printf("%s\\n", one->if_name);
    if_freenameindex(names);
    struct ifreq asked = {.ifr_name = "can1"};
    said("ethtool", ioctl(socket(AF_INET, SOCK_DGRAM, 0), SIOCETHTOOL, &asked));
}
static void until_down(void) {
    int s = bound("can1"), pipes[2];
    frame.can_id = 0x557;
    while (write(s, &frame, sizeof frame) > 0) usleep(10000);
    said("down", -1);
    said("send", send(s, &frame, sizeof frame, 0));
    syscall(SYS_close, s);
    /* The number is given out again behind the library's back. */
    said("again", pipe(pipes) == 0 && pipes[0] == s ? 1 : 0);
    dup2(pipes[1], 50);
    said("frame in a pipe", write(pipes[1], &frame, sizeof frame));
    said("text in a pipe", write(pipes[1], "abc", 3));
}
int main(int count, char **words) {
    void (*parts[])(void) = {sizes, addresses, duplicates, interfaces, until_down};
    parts[count > 1 ? words[1][0] - '0' : 0]();
    return 0;
}
"""

FRAME_SIZE = 16


@pytest.fixture(scope="session")
def every_call(tmp_path_factory: pytest.TempPathFactory) -> Path:
    needs("gcc")
    folder = tmp_path_factory.mktemp("program")
    (folder / "calls.c").write_text(EVERY_CALL)
    subprocess.run(["gcc", str(folder / "calls.c"), "-o", str(folder / "calls")], check=True)
    return folder / "calls"


def said(served: Served, program: Path, part: int) -> list[str]:
    done = served.run(str(program), str(part))
    assert done.returncode == 0, done.stderr
    return [line.strip() for line in done.stdout.splitlines()]


def test_frames_are_looked_at_as_the_kernel_does(served: Served, every_call: Path) -> None:
    """net/can/raw.c: EINVAL for another size and for more than eight bytes, ENXIO for a socket without an interface."""
    with UnixBus(served.path) as bus:
        assert said(served, every_call, 0) == [
            f"frame {FRAME_SIZE}",
            "short -1 EINVAL",
            "nothing -1 EINVAL",
            "dlc 9 -1 EINVAL",
            "fd frame -1 EINVAL",
            f"in parts {FRAME_SIZE}",
            "one part -1 EINVAL",
            f"message {FRAME_SIZE}",
            "unbound -1 ENXIO",
        ]
        heard = [message for _ in range(3) if (message := bus.recv(PATIENCE)) is not None]
        assert [(one.arbitration_id, one.dlc) for one in heard] == [(0x555, 1)] * 3
        assert bus.recv(0.2) is None


def test_an_address_names_the_interface(served: Served, every_call: Path, tmp_path: Path) -> None:
    with UnixHub(tmp_path / "can1") as other:
        served.add("can1", tmp_path / "can1")
        assert said(served, every_call, 1) == [
            f"to another {FRAME_SIZE}",
            f"from unbound {FRAME_SIZE}",
            "to nobody -1 ENXIO",
        ]
        heard = [message for _ in range(4) if (message := other.recv(1.0)) is not None]
        assert [one.arbitration_id for one in heard] == [0x556, 0x556]


def test_a_duplicate_is_the_same_socket_and_a_number_given_out_again_is_not(served: Served, every_call: Path) -> None:
    assert said(served, every_call, 2) == ["option 0", "name 1", "length -1 EINVAL"] * 3 + [
        "closed -1 EBADF",
        "pipe 0",
        "other 3",
    ]


def test_interfaces_are_in_every_list(served: Served, every_call: Path, tmp_path: Path) -> None:
    served.add("can1", tmp_path / "can1")
    assert said(served, every_call, 3) == ["can0 1 1", "can1 1 1", "lo", "can0", "can1", "ethtool -1 EOPNOTSUPP"]


def test_a_hub_that_goes_is_a_network_that_is_down_and_no_signal(
    served: Served, every_call: Path, tmp_path: Path
) -> None:
    served.add("can1", tmp_path / "can1")
    with UnixHub(tmp_path / "can1") as other:
        running = served.start(str(every_call), "4")
        while (message := other.recv(0.1)) is None or message.arbitration_id != 0x557:
            assert running.poll() is None
    written = running.communicate(timeout=PATIENCE)[0].splitlines()
    assert [line.strip() for line in written] == [
        "down -1 ENETDOWN",
        "send -1 ENETDOWN",
        "again 1",
        f"frame in a pipe {FRAME_SIZE}",
        "text in a pipe 3",
    ]


INTERFACES = """
import pathlib, socket
print([name for _, name in socket.if_nameindex() if name.startswith("can")])
print([line.split(":")[0].strip() for line in pathlib.Path("/proc/net/dev").read_text().splitlines() if "can" in line])
bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
bus.bind(("can1",))
copy = bus.dup()
bus.close()
copy.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS, 1)
copy.send(bytes.fromhex("5505000001000000") + bytes(8))
print(copy.recv(16)[:4].hex(), copy.getsockname())
"""


def test_python_finds_the_interfaces_and_a_duplicate_takes_options(served: Served, tmp_path: Path) -> None:
    done = threading.Event()
    with UnixHub(tmp_path / "can1") as other:
        served.add("can1", tmp_path / "can1")

        def serve() -> None:
            while not done.is_set():
                other.recv(0.01)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            answer = served.run(sys.executable, "-c", INTERFACES)
        finally:
            done.set()
            thread.join()
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.splitlines() == ["['can0', 'can1']", "['can0', 'can1']", "55050000 ('can1',)"]


PSUTIL = """
import psutil
found = psutil.net_if_stats()["can0"]
print(found.isup, found.mtu)
"""


def test_psutil_sees_an_interface_that_is_up(served: Served) -> None:
    """canopen-monitor waits until psutil.net_if_stats() has its interface, and is up."""
    pytest.importorskip("psutil")
    answer = served.run(sys.executable, "-c", PSUTIL)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.split() == ["True", "16"]


def on_a_terminal(command: list[str], environ: dict[str, str], until: str) -> str:
    """What a program writes to a terminal of 120 columns, until some text is there."""
    process, terminal = pty.fork()
    if process == 0:
        os.execvpe(command[0], command, {**environ, "TERM": "xterm"})
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 120, 0, 0))
    written, deadline = b"", time.monotonic() + PATIENCE
    try:
        while until not in written.decode(errors="replace") and time.monotonic() < deadline:
            if select.select([terminal], [], [], 0.1)[0]:
                written += os.read(terminal, 65536)
    except OSError:
        # It has ended, and its terminal with it.
        pass
    finally:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        os.close(terminal)
    return written.decode(errors="replace")


def test_canopen_monitor_shows_who_is_alive(served: Served) -> None:
    """It asks psutil whether its interface is up, and draws on a terminal (pip install canopen-monitor)."""
    if shutil.which("canopen-monitor") is None:
        pytest.skip("canopen-monitor is not installed")
    assert served.run("cansend", "can0", "602#2B171000F4010000").returncode == 0
    shown = on_a_terminal(["canopen-monitor", "-i", "can0"], served.environ, "Pre-operational")
    assert "0x2" in shown
    assert "Pre-operational" in shown


def test_two_buses_are_two_interfaces_of_one_program(served: Served, tmp_path: Path) -> None:
    second = Served(tmp_path / "second", served.library)
    try:
        served.add("can1", second.path)
        second.server.faults.add("power@drive_fl")
        dump = listening(served, "-n", "1", "-L", "can0,580:780")
        other = second.hub.clients
        silent = served.start("candump", "-T", "1500", "-L", "can1,580:780")
        while second.hub.clients == other:
            time.sleep(0.01)
        for interface in ("can0", "can1"):
            assert served.run("cansend", interface, "601#4000100000000000").returncode == 0
        assert "can0 581#" in dump.communicate(timeout=PATIENCE)[0]
        assert silent.communicate(timeout=PATIENCE)[0] == ""
    finally:
        second.close()


def test_other_sockets_of_the_program_stay_what_they_are(served: Served) -> None:
    code = (
        "import socket; a, b = socket.socketpair(); a.send(b'x'); print(b.recvfrom(1)[0], a.getsockname());"
        "s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); s.bind(('127.0.0.1', 0));"
        "s.sendto(b'y', s.getsockname()); print(s.recvfrom(1)[0], s.recvfrom is not None, socket.if_nameindex()[0][1])"
    )
    done = served.run(sys.executable, "-c", code)
    assert done.returncode == 0, done.stderr
    assert "b'x'" in done.stdout
    assert "b'y' True lo" in done.stdout


def test_an_interface_that_is_not_there_is_refused_as_by_the_kernel(served: Served) -> None:
    needs("cansend")
    done = served.run("cansend", "can9", "123#")
    assert done.returncode != 0
    assert "No such device" in done.stderr + done.stdout


def test_a_bus_that_nobody_serves_is_a_network_that_is_down(tmp_path: Path, library: Path) -> None:
    needs("cansend")
    found = environment(os.environ, library, {"can0": tmp_path / "nobody"})
    done = subprocess.run(["cansend", "can0", "123#"], env=found, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "Network is down" in done.stderr


@pytest.mark.parametrize(
    "compiler",
    [
        # The first build of the cross compiler takes a quarter of a minute.
        pytest.param(one, marks=[pytest.mark.slow] if "ziglang" in one else [], id=Path(one[-1]).name)
        for one in compilers()
    ],
)
def test_every_compiler_found_here_builds_the_library_once(compiler: list[str], tmp_path: Path) -> None:
    first = build_library(tmp_path, compiler)
    built = first.stat().st_mtime_ns
    assert build_library(tmp_path, ["no compiler is asked again"]) == first
    assert first.stat().st_mtime_ns == built
    assert first.read_bytes()[:4] == b"\x7fELF"


def test_a_compiler_that_fails_is_a_user_error(tmp_path: Path) -> None:
    with pytest.raises(BusError, match="cannot build"):
        build_library(tmp_path, ["false"])
    with pytest.raises(BusError, match="cannot be built"):
        build_library(tmp_path, ["/no/such/compiler"])


@pytest.mark.parametrize("name", ["", "a-name-much-too-long", "can,0", "can=0"])
def test_names_that_are_no_interface_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(BusError, match="cannot be a CAN interface"):
        environment({}, tmp_path / "library.so", {name: tmp_path / "bus"})


def test_what_is_preloaded_already_stays_preloaded(tmp_path: Path) -> None:
    found = environment({"LD_PRELOAD": "/other.so", "HOME": "/root"}, tmp_path / "library.so", {"can0": tmp_path})
    assert found["LD_PRELOAD"] == f"{tmp_path / 'library.so'}:/other.so"
    assert found["HOME"] == "/root"
