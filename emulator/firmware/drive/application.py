"""The firmware of one wheel drive: state machine, modes, stops and faults put together (CiA 402-2)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from emulator.firmware.drive.activity import Activity, make_motions
from emulator.firmware.drive.axis import Axis
from emulator.firmware.drive.faults import (
    CONNECTION_LOST,
    FOLLOWING_ERROR,
    NOT_OPERATIONAL,
    OF_TRIP,
    SETPOINTS_MISSING,
    STOPPED_OUTSIDE,
    Fault,
)
from emulator.firmware.drive.modes import HALTING_MODES, TORQUE_MODES, Mode, Motion
from emulator.firmware.drive.objects import bind
from emulator.firmware.drive.options import (
    DISABLE_OPERATION_OPTIONS,
    FAULT_REACTION_OPTIONS,
    HALT_OPTIONS,
    QUICK_STOP_OPTIONS,
    SHUTDOWN_OPTIONS,
    AbortConnection,
    StopKind,
)
from emulator.firmware.drive.parameters import Parameters
from emulator.firmware.drive.states import Command, State, StateMachine
from emulator.firmware.drive.status import compose
from emulator.firmware.drive.stopping import Stop
from emulator.firmware.drive.supervision import Supervision
from emulator.firmware.hardware import DriveHardware
from emulator.firmware.nmt import NmtState
from emulator.firmware.node import Node
from emulator.power_stage import Trip

_HALT = 1 << 8
_COMMAND_BITS = 0x8F
_ENABLE_OPERATION = 0x0F

_OPERATING = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)

_FAULTY = (State.FAULT_REACTION_ACTIVE, State.FAULT)

_DEFERRED: Mapping[int, tuple[int, Mapping[int, StopKind]]] = {
    5: (0x605C, DISABLE_OPERATION_OPTIONS),
    8: (0x605B, SHUTDOWN_OPTIONS),
}
"""Transitions that a ramp may come before -> option code."""

_POWERING = (3, 4, 15, 16)
"""Transitions towards power, and out of a fault: none while the emergency stop is pressed."""


class DriveApplication:
    """The firmware of one wheel drive.

    Args:
        node: its CANopen services.
        hardware: power stage, motor and encoder.
    """

    def __init__(self, node: Node, hardware: DriveHardware) -> None:
        self._node = node
        self._hardware = hardware
        self._parameters = Parameters(node.object_dictionary, hardware.counts_per_revolution)
        self.axis = Axis(hardware, self._parameters, node.timers)
        self._points = self.axis.points
        self._machine = StateMachine(self._carry_out, self._ready)
        self._motions = make_motions(self.axis)
        self._activity = Activity(node.timers, self._tick)
        self._supervision = Supervision(self.axis, hardware, self._parameters)
        self._stop = Stop(self.axis)
        self._reaction = StopKind.DISABLE
        self._after_stop: int | None = None
        self._on_transition: Mapping[int, Callable[[], None]] = {
            4: self._enable_operation,
            5: self._switch_off_power,
            8: self._switch_off_power,
            9: self._switch_off_power,
            11: self._start_quick_stop,
            12: self._switch_off_power,
            13: self._react_to_fault,
            14: self._switch_off_power,
            15: self._forget_fault,
            16: self._enable_operation,
        }
        self.mode = Mode.NONE
        self.error_code = 0
        self.statusword = 0
        self._halted = False
        self._found_at_boot: Fault | None = None
        self._stopped_outside = False
        hardware.watch(self._tripped)
        bind(self, node.object_dictionary)

    @property
    def state(self) -> State:
        """State of the power drive system."""
        return self._machine.state

    @property
    def remote(self) -> bool:
        """Bit 9 of the statusword: the controlword is processed."""
        return self._node.nmt.state is NmtState.OPERATIONAL

    @property
    def moving(self) -> bool:
        """The power is on, and the axis moves as it is told to or by its own ramps."""
        return self.state in _OPERATING

    def reset(self) -> None:
        """Power-on values: torque off, no mode, state machine through transitions 0 and 1."""
        self._parameters.load()
        self._run(None)
        self._hardware.disable()
        self.axis.reset()
        self.mode = Mode.NONE
        self.error_code = 0
        self._after_stop = None
        self._halted = False
        self._machine.start()
        self._update_status()

    def nmt_changed(self, state: NmtState) -> None:
        """Leaving operational while the drive runs is a lost connection too (CiA 402, 6007h)."""
        if state is not NmtState.OPERATIONAL and self.state in _OPERATING:
            self._abort(NOT_OPERATIONAL)
        found, self._found_at_boot = self._found_at_boot, None
        if found is not None:
            self.fail(found)
        self._update_status()

    def rpdo_applied(self) -> None:
        """Act on the controlword and the set-points, which are all in place now."""
        controlword = self._points.controlword
        self._machine.control(controlword)
        if bool(controlword & _HALT) is not self._halted:
            self._halt(not self._halted)
        if self._after_stop in _DEFERRED and controlword & _COMMAND_BITS == _ENABLE_OPERATION:
            self._after_stop = None
            self._operate()
            self._update_status()
        self.follow()

    def follow(self) -> None:
        """Act on set-points that have changed."""
        motion, limited = self._activity.motion, self.axis.limited
        if motion is not None:
            motion.take()
            if motion.ticks or self.axis.limited is not limited:
                self._update_status()

    def sample(self) -> None:
        """Look after the drive; process values are read when they are sent, time stands still meanwhile."""
        motion = self._activity.motion
        if motion is not None and not motion.ticks:
            self._supervise()

    def connection_lost(self) -> None:
        """Do what 6007h says."""
        self._abort(CONNECTION_LOST)

    def rpdo_missing(self) -> None:
        """Set-points do not come any more: a fault where the drive moves by them."""
        if self.state in _OPERATING:
            self.fail(SETPOINTS_MISSING)

    def select(self, mode: Mode) -> None:
        """Change the mode of operation, at once where operation is enabled."""
        if mode is not self.mode:
            self.mode = mode
            self.axis.goal = None
            if self.state is State.OPERATION_ENABLED and self._after_stop is None:
                self._operate()
            self._update_status()

    def fail(self, fault: Fault) -> None:
        """Transition 13, or the end of a fault reaction that has become impossible.

        What goes wrong while a fault is there already is told, too: 603Fh is the last error.
        """
        self.error_code = fault.code
        self._node.emergency.report(fault.code, fault.register)
        if self.state in _FAULTY:
            if fault.fatal:
                self._machine.take(14)
            return
        kind = FAULT_REACTION_OPTIONS[self._option(0x605E)]
        self._reaction = StopKind.DISABLE if fault.fatal or self.state not in _OPERATING else kind
        self._machine.take(13)

    def trip(self, fault: Fault) -> None:
        """The protection has noticed something, whatever the power does; a drive without supply finds it at boot."""
        if self._node.nmt.state is NmtState.INITIALISATION:
            self._found_at_boot = fault
        else:
            self.fail(fault)

    def press_stop(self) -> None:
        """The emergency stop takes the supply of the power stage, which stays off (stop category 0, IEC 60204-1)."""
        self._stopped_outside = True
        self.trip(STOPPED_OUTSIDE)

    def release_stop(self) -> None:
        """The power may be had again; the fault stays until the master resets it."""
        self._stopped_outside = False

    def _option(self, index: int) -> int:
        return self._node.object_dictionary.value(index)

    def _abort(self, fault: Fault) -> None:
        option = self._option(0x6007)
        if option == AbortConnection.FAULT:
            # A drive that has a fault already leaves operational, or its master leaves it, because of that.
            if self.state not in _FAULTY:
                self.fail(fault)
        elif option == AbortConnection.DISABLE_VOLTAGE:
            self._points.forget()
            self._machine.command(Command.DISABLE_VOLTAGE)
        elif option == AbortConnection.QUICK_STOP:
            self._machine.command(Command.QUICK_STOP)

    def _tripped(self, trip: Trip) -> None:
        self.trip(OF_TRIP[trip])

    def _ready(self, number: int) -> bool:
        """Whether a transition may be taken now; one that a ramp comes before is taken at the end of the ramp."""
        if self._stopped_outside and number in _POWERING:
            return False
        if number == 16:
            return QUICK_STOP_OPTIONS[self._option(0x605A)].stays
        if number == 15:
            return self._hardware.thermal_load < 1.0
        if number not in _DEFERRED:
            return True
        index, options = _DEFERRED[number]
        kind = options[self._option(index)]
        if kind is not StopKind.DISABLE and self._after_stop != number:
            self._stop_axis(kind, number)
        return kind is StopKind.DISABLE

    def _carry_out(self, number: int) -> None:
        action = self._on_transition.get(number)
        if action is not None:
            action()
        self._update_status()
        self._node.notify_event()

    def _enable_operation(self) -> None:
        self._hardware.enable()
        self._after_stop = None
        self.axis.goal = None
        self._halted = bool(self._points.controlword & _HALT)
        self._operate()

    def _operate(self) -> None:
        """What the axis does in operation enabled: halt, or move as the mode says."""
        if self._halted and self.mode in HALTING_MODES:
            self._stop_axis(HALT_OPTIONS[self._option(0x605D)], None)
        else:
            self._run(self._motions[self.mode])

    def _switch_off_power(self) -> None:
        self._after_stop = None
        self._run(None)
        self._hardware.disable()
        self.axis.release()

    def _start_quick_stop(self) -> None:
        self._points.forget()
        option = QUICK_STOP_OPTIONS[self._option(0x605A)]
        if option.kind is StopKind.DISABLE:
            self._machine.take(12)
        else:
            self._stop_axis(option.kind, None if option.stays else 12)

    def _react_to_fault(self) -> None:
        self._points.forget()
        if self._reaction is StopKind.DISABLE:
            self._machine.take(14)
        else:
            self._stop_axis(self._reaction, 14)

    def _forget_fault(self) -> None:
        self.error_code = 0
        self._node.emergency.clear()

    def _halt(self, halted: bool) -> None:
        self._halted = halted
        operating = self.state is State.OPERATION_ENABLED and self._after_stop is None
        if operating and self.mode in HALTING_MODES:
            self._operate()
            self._update_status()

    def _stop_axis(self, kind: StopKind, then: int | None) -> None:
        """Come to rest, then take transition `then`, or stay."""
        self._stop.prepare(kind, self.mode in TORQUE_MODES)
        self._after_stop = then
        self._run(self._stop)

    def _run(self, motion: Motion | None) -> None:
        if motion is None:
            self._supervision.reset()
        self._activity.run(motion)

    def _tick(self, motion: Motion) -> None:
        self._supervise()
        if motion is not self._activity.motion:
            return
        motion.tick()
        if motion is self._stop and self._stop.done and self._after_stop is not None:
            self._machine.take(self._after_stop)
        elif motion.failed:
            self.fail(FOLLOWING_ERROR)
        self._update_status()

    def _supervise(self) -> None:
        warned = self._supervision.warns
        if not self._supervision.passes():
            self.fail(OF_TRIP[Trip.ENCODER])
        elif self._supervision.warns is not warned:
            self._update_status()

    def _update_status(self) -> None:
        last, motion = self.statusword, self._activity.motion
        self.statusword = compose(
            self._machine.state,
            remote=self.remote,
            warns=self._supervision.warns,
            limited=self.axis.limited,
            of_mode=motion.status() if motion is not None else 0,
        )
        if self.statusword != last:
            self._node.notify_event()
