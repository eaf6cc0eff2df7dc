"""The 402 state machine, every cell, against the table of the standard written down a second time."""

from __future__ import annotations

import pytest

from emulator.firmware.drive.states import TRANSITIONS, Command, State, StateMachine
from tests.emulator.firmware.coding_table import command_of

# CiA 402-2, figure 4, as an edge list: (transition, from, to, who causes it).
DIAGRAM = [
    (2, "SWITCH_ON_DISABLED", "READY_TO_SWITCH_ON", "shutdown"),
    (3, "READY_TO_SWITCH_ON", "SWITCHED_ON", "switch on"),
    (4, "SWITCHED_ON", "OPERATION_ENABLED", "enable operation"),
    (5, "OPERATION_ENABLED", "SWITCHED_ON", "disable operation"),
    (6, "SWITCHED_ON", "READY_TO_SWITCH_ON", "shutdown"),
    (7, "READY_TO_SWITCH_ON", "SWITCH_ON_DISABLED", "quick stop"),
    (7, "READY_TO_SWITCH_ON", "SWITCH_ON_DISABLED", "disable voltage"),
    (8, "OPERATION_ENABLED", "READY_TO_SWITCH_ON", "shutdown"),
    (9, "OPERATION_ENABLED", "SWITCH_ON_DISABLED", "disable voltage"),
    (10, "SWITCHED_ON", "SWITCH_ON_DISABLED", "quick stop"),
    (10, "SWITCHED_ON", "SWITCH_ON_DISABLED", "disable voltage"),
    (11, "OPERATION_ENABLED", "QUICK_STOP_ACTIVE", "quick stop"),
    (12, "QUICK_STOP_ACTIVE", "SWITCH_ON_DISABLED", "disable voltage"),
    (15, "FAULT", "SWITCH_ON_DISABLED", "fault reset"),
    (16, "QUICK_STOP_ACTIVE", "OPERATION_ENABLED", "enable operation"),
]


def machine_in(state: State, may_resume: bool = True) -> tuple[StateMachine, list[int]]:
    taken: list[int] = []
    machine = StateMachine(taken.append, lambda number: number != 16 or may_resume)
    machine.state = state
    return machine, taken


@pytest.mark.parametrize("state", State, ids=lambda state: state.name)
def test_every_controlword_does_in_every_state_what_the_diagram_says(state: State) -> None:
    for controlword in range(256):
        machine, taken = machine_in(state)
        machine.control(controlword)
        command = command_of(controlword)
        if (state.name, command) == ("OPERATION_ENABLED", "switch on"):
            command = "disable operation"
        edges = [edge for edge in DIAGRAM if (edge[1], edge[3]) == (state.name, command)]
        if (state.name, command) == ("READY_TO_SWITCH_ON", "enable operation"):
            # The standard lets a device do both steps when "switch on" and "enable" come together.
            assert taken == [3, 4]
        else:
            assert taken == [edge[0] for edge in edges]
            assert machine.state.name == (edges[0][2] if edges else state.name)


@pytest.mark.parametrize("bits", range(0, 65536, 256))
def test_manufacturer_and_mode_bits_of_the_controlword_change_no_state(bits: int) -> None:
    machine, taken = machine_in(State.READY_TO_SWITCH_ON)
    machine.control(bits | 0x07)
    assert taken == [3]


def test_power_on_leads_through_transition_one_to_switch_on_disabled() -> None:
    machine, taken = machine_in(State.OPERATION_ENABLED)
    machine.start()
    assert taken == [1]
    assert machine.state is State.SWITCH_ON_DISABLED


def test_a_fault_can_happen_in_every_state_but_while_one_is_being_dealt_with() -> None:
    for state in State:
        machine, taken = machine_in(state)
        machine.take(13)
        assert taken == ([] if state in (State.FAULT, State.FAULT_REACTION_ACTIVE) else [13])
        machine.take(14)
        assert machine.state is State.FAULT


def test_only_the_rising_edge_of_bit_seven_resets_a_fault() -> None:
    machine, taken = machine_in(State.SWITCH_ON_DISABLED)
    machine.control(0x80)
    machine.state = State.FAULT
    machine.control(0x80)
    assert machine.state is State.FAULT
    machine.control(0x00)
    machine.control(0x80)
    assert taken == [15]


def test_a_quick_stop_cannot_be_left_for_operation_enabled_unless_the_drive_stays_in_it() -> None:
    machine, taken = machine_in(State.QUICK_STOP_ACTIVE, may_resume=False)
    machine.control(0x0F)
    assert taken == []


def test_the_table_holds_every_transition_of_the_standard() -> None:
    assert set(TRANSITIONS) == set(range(1, 17))


def test_state_patterns_are_those_of_the_statusword_table() -> None:
    # CiA 402-2, table 30: xxxx xxxx x0xx 0000 and so on, written as (mask, value).
    table = {
        "NOT_READY_TO_SWITCH_ON": (0x4F, 0x00),
        "SWITCH_ON_DISABLED": (0x4F, 0x40),
        "READY_TO_SWITCH_ON": (0x6F, 0x21),
        "SWITCHED_ON": (0x6F, 0x23),
        "OPERATION_ENABLED": (0x6F, 0x27),
        "QUICK_STOP_ACTIVE": (0x6F, 0x07),
        "FAULT_REACTION_ACTIVE": (0x4F, 0x0F),
        "FAULT": (0x4F, 0x08),
    }
    for state in State:
        matching = [name for name, (mask, value) in table.items() if state.value & mask == value]
        assert matching == [state.name]


def test_a_command_that_the_standard_does_not_know_is_no_command() -> None:
    machine, taken = machine_in(State.SWITCHED_ON)
    machine.command(Command.NONE)
    assert taken == []
