"""The drive state machine of CiA 402-2, figure 4 and tables: states, commands, transitions 0 to 16."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto


class State(Enum):
    """States of the power drive system; the value is the pattern of statusword bits 0-3, 5, 6."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


class Command(Enum):
    """Commands of the controlword."""

    NONE = auto()
    SHUTDOWN = auto()
    SWITCH_ON = auto()
    ENABLE_OPERATION = auto()
    DISABLE_VOLTAGE = auto()
    QUICK_STOP = auto()
    FAULT_RESET = auto()


_PATTERNS = (
    (Command.DISABLE_VOLTAGE, 0x82, 0x00),
    (Command.QUICK_STOP, 0x86, 0x02),
    (Command.SHUTDOWN, 0x87, 0x06),
    (Command.SWITCH_ON, 0x8F, 0x07),
    (Command.ENABLE_OPERATION, 0x8F, 0x0F),
)
"""Command, mask, value (CiA 402-2, "command coding"); "disable operation" is "switch on" given while enabled."""

FAULT_RESET_BIT = 0x80


@dataclass(frozen=True)
class Transition:
    """One arrow of the state diagram."""

    source: State
    target: State


_S = State
TRANSITIONS: dict[int, tuple[Transition, ...]] = {
    1: (Transition(_S.NOT_READY_TO_SWITCH_ON, _S.SWITCH_ON_DISABLED),),
    2: (Transition(_S.SWITCH_ON_DISABLED, _S.READY_TO_SWITCH_ON),),
    3: (Transition(_S.READY_TO_SWITCH_ON, _S.SWITCHED_ON),),
    4: (Transition(_S.SWITCHED_ON, _S.OPERATION_ENABLED),),
    5: (Transition(_S.OPERATION_ENABLED, _S.SWITCHED_ON),),
    6: (Transition(_S.SWITCHED_ON, _S.READY_TO_SWITCH_ON),),
    7: (Transition(_S.READY_TO_SWITCH_ON, _S.SWITCH_ON_DISABLED),),
    8: (Transition(_S.OPERATION_ENABLED, _S.READY_TO_SWITCH_ON),),
    9: (Transition(_S.OPERATION_ENABLED, _S.SWITCH_ON_DISABLED),),
    10: (Transition(_S.SWITCHED_ON, _S.SWITCH_ON_DISABLED),),
    11: (Transition(_S.OPERATION_ENABLED, _S.QUICK_STOP_ACTIVE),),
    12: (Transition(_S.QUICK_STOP_ACTIVE, _S.SWITCH_ON_DISABLED),),
    13: tuple(
        Transition(state, _S.FAULT_REACTION_ACTIVE)
        for state in State
        if state not in (_S.FAULT_REACTION_ACTIVE, _S.FAULT)
    ),
    14: (Transition(_S.FAULT_REACTION_ACTIVE, _S.FAULT),),
    15: (Transition(_S.FAULT, _S.SWITCH_ON_DISABLED),),
    16: (Transition(_S.QUICK_STOP_ACTIVE, _S.OPERATION_ENABLED),),
}
"""Number of the standard -> arrows; 0, from power-on to "not ready to switch on", is the start of the machine."""

REACTIONS: dict[tuple[State, Command], tuple[int, ...]] = {
    (_S.SWITCH_ON_DISABLED, Command.SHUTDOWN): (2,),
    (_S.READY_TO_SWITCH_ON, Command.SWITCH_ON): (3,),
    (_S.READY_TO_SWITCH_ON, Command.ENABLE_OPERATION): (3, 4),
    (_S.READY_TO_SWITCH_ON, Command.DISABLE_VOLTAGE): (7,),
    (_S.READY_TO_SWITCH_ON, Command.QUICK_STOP): (7,),
    (_S.SWITCHED_ON, Command.ENABLE_OPERATION): (4,),
    (_S.SWITCHED_ON, Command.SHUTDOWN): (6,),
    (_S.SWITCHED_ON, Command.DISABLE_VOLTAGE): (10,),
    (_S.SWITCHED_ON, Command.QUICK_STOP): (10,),
    (_S.OPERATION_ENABLED, Command.SWITCH_ON): (5,),
    (_S.OPERATION_ENABLED, Command.SHUTDOWN): (8,),
    (_S.OPERATION_ENABLED, Command.DISABLE_VOLTAGE): (9,),
    (_S.OPERATION_ENABLED, Command.QUICK_STOP): (11,),
    (_S.QUICK_STOP_ACTIVE, Command.DISABLE_VOLTAGE): (12,),
    (_S.QUICK_STOP_ACTIVE, Command.ENABLE_OPERATION): (16,),
    (_S.FAULT, Command.FAULT_RESET): (15,),
}
"""What a command does in a state; a pair that is not here does nothing."""


_NOTHING: tuple[int, ...] = ()


def _decode(low_byte: int) -> Command:
    for command, mask, value in _PATTERNS:
        if low_byte & mask == value:
            return command
    return Command.NONE


_ROWS = {
    state: tuple(REACTIONS.get((state, _decode(low_byte)), _NOTHING) for low_byte in range(256)) for state in State
}
"""State -> what each low byte of the controlword leads to: the table above, looked up once a cycle."""


class StateMachine:
    """Power drive system state; `on_transition` is called with each number after the state has changed.

    Args:
        on_transition: carries out what the transition means for the hardware.
        ready: asked before a transition that a command causes; False leaves the state as it is. The drive so
            refuses what it does not support now, and puts off what a ramp has to come before.
    """

    def __init__(self, on_transition: Callable[[int], None], ready: Callable[[int], bool]) -> None:
        self._on_transition = on_transition
        self._ready = ready
        self._reset_level = False
        self.state = State.NOT_READY_TO_SWITCH_ON

    @property
    def state(self) -> State:
        """State of the power drive system."""
        return self._state

    @state.setter
    def state(self, state: State) -> None:
        self._state = state
        self._row = _ROWS[state]

    def start(self) -> None:
        """Transitions 0 and 1: power-on or reset, and the end of initialisation."""
        self.state = State.NOT_READY_TO_SWITCH_ON
        self._reset_level = False
        self.take(1)

    def control(self, controlword: int) -> None:
        """Act on a controlword; a fault reset is the rising edge of bit 7."""
        level = bool(controlword & FAULT_RESET_BIT)
        if level is not self._reset_level:
            self._reset_level = level
            if level:
                self.command(Command.FAULT_RESET)
                return
        for number in self._row[controlword & 0xFF]:
            self._request(number)

    def command(self, command: Command) -> None:
        """Carry out a command as the table says."""
        for number in REACTIONS.get((self.state, command), _NOTHING):
            self._request(number)

    def _request(self, number: int) -> None:
        if self._ready(number):
            self.take(number)

    def take(self, number: int) -> None:
        """Take transition `number` if it leaves the present state."""
        for transition in TRANSITIONS[number]:
            if transition.source is self.state:
                self.state = transition.target
                self._on_transition(number)
                return
