"""State x controlword x mode, every cell, on the whole drive: state, power, and every bit of the statusword."""

from __future__ import annotations

import pytest

from emulator.firmware.drive.modes import Mode
from emulator.firmware.drive.states import State
from emulator.power_stage import Trip
from tests.emulator.firmware.coding_table import command_of

HALT = 0x100

# CiA 402-2, figure 4 and the command coding table, for a shaft at rest and the default option codes:
# a ramp that comes before a transition is over as soon as the shaft stands.
NEXT = {
    ("SWITCH_ON_DISABLED", "shutdown"): "READY_TO_SWITCH_ON",
    ("READY_TO_SWITCH_ON", "switch on"): "SWITCHED_ON",
    ("READY_TO_SWITCH_ON", "enable operation"): "OPERATION_ENABLED",
    ("READY_TO_SWITCH_ON", "disable voltage"): "SWITCH_ON_DISABLED",
    ("READY_TO_SWITCH_ON", "quick stop"): "SWITCH_ON_DISABLED",
    ("SWITCHED_ON", "enable operation"): "OPERATION_ENABLED",
    ("SWITCHED_ON", "shutdown"): "READY_TO_SWITCH_ON",
    ("SWITCHED_ON", "disable voltage"): "SWITCH_ON_DISABLED",
    ("SWITCHED_ON", "quick stop"): "SWITCH_ON_DISABLED",
    ("OPERATION_ENABLED", "switch on"): "SWITCHED_ON",
    ("OPERATION_ENABLED", "shutdown"): "READY_TO_SWITCH_ON",
    ("OPERATION_ENABLED", "disable voltage"): "SWITCH_ON_DISABLED",
    ("OPERATION_ENABLED", "quick stop"): "SWITCH_ON_DISABLED",
    ("QUICK_STOP_ACTIVE", "disable voltage"): "SWITCH_ON_DISABLED",
    ("QUICK_STOP_ACTIVE", "enable operation"): "OPERATION_ENABLED",
    ("FAULT", "fault reset"): "SWITCH_ON_DISABLED",
}
PATTERN = {
    "NOT_READY_TO_SWITCH_ON": 0x00,
    "SWITCH_ON_DISABLED": 0x40,
    "READY_TO_SWITCH_ON": 0x21,
    "SWITCHED_ON": 0x33,
    "OPERATION_ENABLED": 0x37,
    "QUICK_STOP_ACTIVE": 0x17,
    "FAULT_REACTION_ACTIVE": 0x1F,
    "FAULT": 0x08,
}
"""Bits 0-3, 5, 6, and bit 4 (voltage enabled) where the power stage is on."""

MODE_BITS = {
    Mode.NONE: 0x0000,
    Mode.PROFILE_POSITION: 0x0400,
    Mode.PROFILE_VELOCITY: 0x1400,
    Mode.PROFILE_TORQUE: 0x0400,
    Mode.HOMING: 0x0400,
    Mode.CYCLIC_POSITION: 0x1000,
    Mode.CYCLIC_VELOCITY: 0x1000,
    Mode.CYCLIC_TORQUE: 0x1000,
}
"""Operation enabled at rest, targets zero: PP nothing to do, PV target reached and speed 0, TQ target reached,
HM not started, cyclic modes following."""


WAYS = {
    "SWITCH_ON_DISABLED": (),
    "READY_TO_SWITCH_ON": (0x06,),
    "SWITCHED_ON": (0x06, 0x07),
    "OPERATION_ENABLED": (0x06, 0x0F),
    "QUICK_STOP_ACTIVE": (0x06, 0x0F, 0x02),
    "FAULT": (0x06, 0x0F),
}
"""Controlwords that lead from power-on to a state; a trip leads on to fault."""


class Cell:
    """One drive with a shaft at rest."""

    def __init__(self, wire) -> None:
        self._wire = wire
        self.node = wire.devices.nodes[1]
        self.drive = self.node.application
        wire.nmt(0x01, 1)

    def control(self, controlword: int) -> None:
        self.drive.axis.points.controlword = controlword
        self.drive.rpdo_applied()

    def bring_to(self, state: str, mode: Mode) -> None:
        self.drive.reset()
        self.drive.select(mode)
        for controlword in WAYS[state]:
            self.control(controlword)
        if state == "FAULT":
            self._wire.vehicle.drives[0].trip(Trip.OVER_VOLTAGE)
        assert self.drive.state.name == state

    def settle(self) -> None:
        self._wire.devices.advance(round(self._wire.devices.time + 0.015, 9))


@pytest.fixture
def cell(wire) -> Cell:
    # A resumable quick stop makes all six states at rest reachable.
    wire.write(1, 0x605A, 0, b"\x06\x00")
    return Cell(wire)


@pytest.mark.parametrize("mode", Mode, ids=lambda mode: mode.name)
@pytest.mark.parametrize("state", WAYS)
def test_every_controlword_leads_where_the_diagram_says_and_shows_it(cell: Cell, state: str, mode: Mode) -> None:
    for controlword in range(256):
        cell.bring_to(state, mode)
        cell.control(controlword)
        cell.settle()
        after = NEXT.get((state, command_of(controlword)), state)
        if (state, command_of(controlword)) == ("OPERATION_ENABLED", "quick stop"):
            after = "QUICK_STOP_ACTIVE"
        assert cell.drive.state.name == after
        bits = cell.drive.statusword
        assert bits & 0x7F == PATTERN[after]
        assert bits & 0x200, "bit 9: the node is operational"
        assert not bits & 0x8880, "no warning, no limit, no manufacturer's bit"
        assert bits & 0x3400 == expected_mode_bits(state, after, mode, controlword)
        assert cell.drive.axis.hardware.enabled is (after in ("OPERATION_ENABLED", "QUICK_STOP_ACTIVE"))


def expected_mode_bits(before: str, state: str, mode: Mode, controlword: int) -> int:
    if state == "QUICK_STOP_ACTIVE":
        return 0x0400
    if state != "OPERATION_ENABLED":
        return 0
    if not controlword & 0x10:
        return MODE_BITS[mode]
    # Homing and new set-points need the rising edge of bit 4 while operation is enabled.
    edge = before == "OPERATION_ENABLED"
    return 0x1400 if edge and mode in (Mode.HOMING, Mode.PROFILE_POSITION) else MODE_BITS[mode]


HALTS = {
    Mode.PROFILE_POSITION: 0x0400,
    Mode.PROFILE_VELOCITY: 0x0400,
    Mode.PROFILE_TORQUE: 0x0400,
    Mode.HOMING: 0x0400,
}


@pytest.mark.parametrize("mode", Mode, ids=lambda mode: mode.name)
def test_bit_eight_halts_in_the_modes_that_have_a_halt_and_changes_no_state(cell: Cell, mode: Mode) -> None:
    for state in WAYS:
        cell.bring_to(state, mode)
        cell.control((WAYS[state][-1] if WAYS[state] else 0) | HALT)
        cell.settle()
        assert cell.drive.state.name == state
        if state == "OPERATION_ENABLED":
            assert cell.drive.statusword & 0x3400 == HALTS.get(mode, MODE_BITS[mode])


@pytest.mark.parametrize("mode", Mode, ids=lambda mode: mode.name)
def test_a_trip_is_a_fault_in_every_state_and_mode(cell: Cell, mode: Mode) -> None:
    for state in WAYS:
        cell.bring_to(state, mode)
        cell._wire.vehicle.drives[0].trip(Trip.OVER_CURRENT)
        assert cell.drive.state is State.FAULT
        assert not cell.drive.axis.hardware.enabled


@pytest.mark.parametrize("mode", Mode, ids=lambda mode: mode.name)
def test_no_mode_leaves_a_torque_behind_when_the_power_goes_off(cell: Cell, mode: Mode) -> None:
    cell.bring_to("OPERATION_ENABLED", mode)
    points = cell.drive.axis.points
    points.target_torque, points.target_velocity = 300, 10**6
    points.aim(10**6)
    cell.control(0x0F)
    cell.settle()
    assert (cell.drive.axis.torque_demand != 0) is (mode not in (Mode.NONE, Mode.HOMING, Mode.PROFILE_POSITION))
    cell.control(0x00)
    assert cell.drive.axis.torque_demand == 0
    assert cell._wire.vehicle.drives[0].torque == 0.0
