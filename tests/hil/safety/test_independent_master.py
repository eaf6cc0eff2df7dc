"""A master that is none of ours, BaseNode402 of python canopen, moves the emulated vehicle in real time."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from hil.bus.opening import open_bus
from hil.network import DEFAULT_NETWORK

COUNTS = 1048576
FORWARD = {1: 1, 2: 1, 3: -1, 4: -1}
"""Node -> sign of a shaft that rolls its wheel forward; the right side is mounted the other way round."""

MASTER = 127
PATIENCE = 30.0


@pytest.fixture
def bus_name(tmp_path: Path) -> Iterator[str]:
    """The emulated prototype, served by the command line in a process of its own."""
    name = f"unix:{tmp_path}/can0"
    command = [sys.executable, "-m", "quasiomni", "emulate", "--bus", name]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        while "is up on" not in process.stdout.readline():
            assert process.poll() is None
        yield name
    finally:
        process.terminate()
        process.communicate(timeout=30)


@pytest.fixture
def nodes(bus_name: str) -> Iterator[dict[int, BaseNode402]]:
    network = canopen.Network(open_bus(bus_name))
    network.connect()
    network.NOTIFIER_SHUTDOWN_TIMEOUT = 2.0
    made = {number: BaseNode402(number, str(DEFAULT_NETWORK.with_name("drive.eds"))) for number in FORWARD}
    for node in made.values():
        node.sdo.RESPONSE_TIMEOUT = PATIENCE
        # The machine that runs this may be busy with other things.
        node.TIMEOUT_CHECK_TPDO = node.TIMEOUT_SWITCH_OP_MODE = PATIENCE
        node.TIMEOUT_SWITCH_STATE_FINAL = node.TIMEOUT_SWITCH_STATE_SINGLE = PATIENCE
        network.add_node(node)
    try:
        yield made
    finally:
        network.disconnect()


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def speed(node: BaseNode402) -> float:
    """Of the wheel's motor, forward positive [revolutions / s]."""
    return FORWARD[node.id] * node.sdo[0x606C].raw / COUNTS


def bring_up(node: BaseNode402) -> None:
    node.nmt.state = "PRE-OPERATIONAL"
    # BaseNode402 waits for the next TPDO once it has seen two: they have to come without an event too.
    node.sdo[0x1800][5].raw = 20
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"


def test_enable_move_quick_stop_fault_reset_and_home(nodes: dict[int, BaseNode402]) -> None:
    for node in nodes.values():
        bring_up(node)
        assert node.state == "OPERATION ENABLED"
        assert node.op_mode == "PROFILED VELOCITY"
        node.sdo[0x605A].raw = 6
    start = nodes[1].sdo[0x6064].raw
    for node in nodes.values():
        node.sdo[0x60FF].raw = FORWARD[node.id] * 5 * COUNTS
    wait_for(lambda: all(abs(speed(node) - 5.0) < 0.1 for node in nodes.values()))
    wait_for(lambda: all(node.sdo[0x6041].raw & 1 << 10 for node in nodes.values()))
    wait_for(lambda: nodes[1].sdo[0x6064].raw > start + 5 * COUNTS)
    assert abs(nodes[1].sdo[0x6077].raw) > 20, "friction asks for torque"

    for node in nodes.values():
        node.state = "QUICK STOP ACTIVE"
    wait_for(lambda: all(abs(speed(node)) < 0.02 for node in nodes.values()))
    assert {node.state for node in nodes.values()} == {"QUICK STOP ACTIVE"}

    # A heartbeat that is announced and then stays away is a fault (1016h, 6007h).
    nodes[2].sdo[0x1029][1].raw = 1
    nodes[2].state = "OPERATION ENABLED"
    nodes[2].sdo[0x60FF].raw = 0
    nodes[2].sdo[0x1016][1].raw = MASTER << 16 | 100
    nodes[2].network.send_message(0x700 + MASTER, b"\x05")
    wait_for(lambda: nodes[2].sdo[0x6041].raw & 0x4F == 0x08)
    assert nodes[2].sdo[0x603F].raw == 0x8130
    assert nodes[2].emcy.log[-1].code == 0x8130
    nodes[2].sdo[0x1016][1].raw = 0
    wait_for(nodes[2].is_faulted)
    nodes[2].reset_from_fault()
    assert nodes[2].state == "OPERATION ENABLED"
    assert nodes[2].sdo[0x603F].raw == 0

    nodes[2].sdo[0x6098].raw = 37
    nodes[2].sdo[0x607C].raw = 4711
    # The first statusword that BaseNode402 looks at may be older than its controlword; it then gives up at once.
    wait_for(lambda: nodes[2].homing(timeout=PATIENCE))
    assert abs(nodes[2].sdo[0x6064].raw - 4711) < COUNTS // 100

    for node in nodes.values():
        node.state = "SWITCH ON DISABLED"
        assert node.state == "SWITCH ON DISABLED"
