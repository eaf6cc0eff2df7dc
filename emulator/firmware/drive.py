"""Drive profile CiA 402: state machine, cyclic synchronous torque, quick stop, reaction to lost masters."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import IntEnum

from emulator.firmware.dictionary import AbortCode, AbortError
from emulator.firmware.drive_states import Command, State, StateMachine
from emulator.firmware.emergency import ErrorCode, ErrorRegister
from emulator.firmware.hardware import DriveHardware
from emulator.firmware.nmt import NmtState
from emulator.firmware.node import Node
from emulator.firmware.timers import Timer

_RAMP_PERIOD = 0.001
"""Step of the torque ramp of a quick stop [s]."""

CYCLIC_SYNCHRONOUS_TORQUE = 10
_MODES = (0, CYCLIC_SYNCHRONOUS_TORQUE)


class AbortConnection(IntEnum):
    """Values of 6007h: what the loss of the master leads to."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


class QuickStop(IntEnum):
    """Values of 605Ah that this drive knows; in a torque mode both ramps go to zero torque at 6087h."""

    DISABLE = 0
    SLOW_DOWN = 1
    QUICK_STOP_RAMP = 2
    SLOW_DOWN_AND_STAY = 5
    QUICK_STOP_RAMP_AND_STAY = 6


_POWERED = (State.SWITCHED_ON, State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
_OPERATING = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)

_VOLTAGE_ENABLED = 1 << 4
_REMOTE = 1 << 9
_INTERNAL_LIMIT = 1 << 11
_FOLLOWS_COMMAND = 1 << 12


class DriveApplication:
    """The firmware of one wheel drive.

    Args:
        node: its CANopen services.
        hardware: power stage, motor and encoder.
    """

    def __init__(self, node: Node, hardware: DriveHardware) -> None:
        self._node = node
        self._hardware = hardware
        self._permille = hardware.rated_torque / 1000.0
        self._machine = StateMachine(self._carry_out, self._stays_in_quick_stop)
        self._on_transition: dict[int, Callable[[], None]] = {
            4: self._switch_on_power,
            5: self._switch_off_power,
            8: self._switch_off_power,
            9: self._switch_off_power,
            11: self._start_quick_stop,
            12: self._switch_off_power,
            13: self._react_to_fault,
            15: self._forget_fault,
            16: self._stop_ramp,
        }
        self._controlword = 0
        self._target = 0
        self._demand = 0
        self._mode = 0
        self._limited = False
        self._error_code = 0
        self._ramp: Timer | None = None
        self._statusword = 0
        self._bind()

    @property
    def state(self) -> State:
        """State of the power drive system."""
        return self._machine.state

    def reset(self) -> None:
        """Power-on values: torque off, no mode, state machine through transitions 0 and 1."""
        self._stop_ramp()
        self._hardware.disable()
        read = self._node.object_dictionary.value
        self._controlword = self._target = self._demand = self._mode = self._error_code = 0
        self._limit = read(0x6072)
        self._limited = False
        self._machine.start()
        self._update_status()

    def nmt_changed(self, state: NmtState) -> None:
        """Leaving operational while the drive runs is a lost connection too (CiA 402, 6007h)."""
        if state is not NmtState.OPERATIONAL and self.state in _OPERATING:
            self.connection_lost()
        self._update_status()

    def rpdo_applied(self) -> None:
        """Act on the controlword and the target torque, which are both in place now."""
        self._machine.control(self._controlword)
        self._follow_target()

    def sample(self) -> None:
        """Process values are read from the hardware when they are sent; time stands still meanwhile."""

    def connection_lost(self) -> None:
        """Do what 6007h says."""
        option = self._node.object_dictionary.value(0x6007)
        if option == AbortConnection.FAULT:
            self.fail(ErrorCode.HEARTBEAT)
        elif option == AbortConnection.DISABLE_VOLTAGE:
            self._machine.command(Command.DISABLE_VOLTAGE)
        elif option == AbortConnection.QUICK_STOP:
            self._machine.command(Command.QUICK_STOP)

    def fail(self, error_code: int) -> None:
        """Transition 13: a fault with this code (603Fh)."""
        self._error_code = error_code
        self._machine.take(13)

    def _bind(self) -> None:
        objects = self._node.object_dictionary
        hardware = self._hardware
        rated_current = round(hardware.rated_current * 1000.0)
        increments = hardware.counts_per_revolution / math.tau
        reads: dict[tuple[int, int], Callable[[], int]] = {
            (0x603F, 0): lambda: self._error_code,
            (0x6040, 0): lambda: self._controlword,
            (0x6041, 0): lambda: self._statusword,
            (0x6060, 0): lambda: self._mode,
            (0x6061, 0): lambda: self._mode,
            (0x6064, 0): lambda: _wrap_i32(hardware.position()),
            (0x606C, 0): lambda: _clamp(round(hardware.velocity() * increments), 2**31 - 1),
            (0x6071, 0): lambda: self._target,
            (0x6074, 0): lambda: self._demand,
            (0x6075, 0): lambda: rated_current,
            (0x6076, 0): lambda: round(hardware.rated_torque * 1000.0),
            (0x6077, 0): self._torque_actual,
            # Torque is proportional to current, so both have the same per-mille value.
            (0x6078, 0): self._torque_actual,
            (0x608F, 1): lambda: hardware.counts_per_revolution,
        }
        for (index, subindex), read in reads.items():
            objects.on_read(index, subindex, read)
        objects.on_write(0x6040, 0, self._write_controlword)
        objects.on_write(0x605A, 0, self._write_quick_stop_option)
        objects.on_write(0x6060, 0, self._write_mode)
        objects.on_write(0x6071, 0, self._write_target)
        objects.on_write(0x6072, 0, self._write_limit)
        objects.on_pdo_write(0x6040, 0, self._latch_controlword)
        objects.on_pdo_write(0x6071, 0, self._latch_target)

    def _latch_controlword(self, value: int) -> None:
        self._controlword = value

    def _latch_target(self, value: int) -> None:
        self._target = value

    def _write_controlword(self, value: int) -> None:
        self._controlword = value
        self.rpdo_applied()

    def _write_target(self, value: int) -> None:
        self._target = value
        self._follow_target()

    def _write_limit(self, value: int) -> None:
        self._limit = value
        self._follow_target()

    def _write_mode(self, value: int) -> None:
        if value not in _MODES:
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)
        self._mode = value
        self._follow_target()

    def _write_quick_stop_option(self, value: int) -> None:
        if value not in tuple(QuickStop):
            raise AbortError(AbortCode.VALUE_RANGE_EXCEEDED)

    def _torque_actual(self) -> int:
        return _clamp(round(self._hardware.measured_torque() / self._permille), 32767)

    def _follow_target(self) -> None:
        if self.state is State.OPERATION_ENABLED:
            target = self._target if self._mode == CYCLIC_SYNCHRONOUS_TORQUE else 0
            self._set_demand(target)

    def _set_demand(self, target: int) -> None:
        self._demand = _clamp(target, self._limit)
        self._hardware.command(self._demand * self._permille)
        if (self._demand != target) is not self._limited:
            self._limited = not self._limited
            self._update_status()

    def _carry_out(self, number: int) -> None:
        action = self._on_transition.get(number)
        if action is not None:
            action()
        self._update_status()
        self._node.notify_event()

    def _switch_on_power(self) -> None:
        self._hardware.enable()

    def _switch_off_power(self) -> None:
        self._stop_ramp()
        self._hardware.disable()
        self._demand = 0
        self._limited = False

    def _stays_in_quick_stop(self) -> bool:
        option = self._node.object_dictionary.value(0x605A)
        return option in (QuickStop.SLOW_DOWN_AND_STAY, QuickStop.QUICK_STOP_RAMP_AND_STAY)

    def _start_quick_stop(self) -> None:
        if self._node.object_dictionary.value(0x605A) == QuickStop.DISABLE:
            self._machine.take(12)
        else:
            self._ramp = self._node.timers.after(_RAMP_PERIOD, self._ramp_down)

    def _ramp_down(self) -> None:
        step = self._node.object_dictionary.value(0x6087) * _RAMP_PERIOD
        self._set_demand(round(max(abs(self._demand) - step, 0.0)) * (1 if self._demand > 0 else -1))
        if self._demand:
            self._ramp = self._node.timers.after(_RAMP_PERIOD, self._ramp_down)
        elif not self._stays_in_quick_stop():
            self._machine.take(12)

    def _stop_ramp(self) -> None:
        if self._ramp is not None:
            self._ramp.cancel()
            self._ramp = None

    def _react_to_fault(self) -> None:
        self._switch_off_power()
        self._node.emergency.report(self._error_code, ErrorRegister.GENERIC)
        self._machine.take(14)

    def _forget_fault(self) -> None:
        self._error_code = 0
        self._node.emergency.clear()

    def _update_status(self) -> None:
        state = self._machine.state
        enabled = state is State.OPERATION_ENABLED
        follows = enabled and self._mode == CYCLIC_SYNCHRONOUS_TORQUE
        remote = self._node.nmt.state is NmtState.OPERATIONAL
        self._statusword = (
            state.value
            | (_VOLTAGE_ENABLED if state in _POWERED else 0)
            | (_REMOTE if remote else 0)
            | (_INTERNAL_LIMIT if self._limited else 0)
            | (_FOLLOWS_COMMAND if follows else 0)
        )


def _clamp(value: int, limit: int) -> int:
    return limit if value > limit else -limit if value < -limit else value


def _wrap_i32(value: int) -> int:
    return (value + 0x80000000 & 0xFFFFFFFF) - 0x80000000
