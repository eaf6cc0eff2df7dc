"""The CANopen master of the vehicle: commissioning, cyclic torque control, supervision, orderly end."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Self

import can

from hil.bus.clock import Clock
from hil.master import commissioning
from hil.master.cycle import Cycle, Sample
from hil.master.drive_states import (
    ENABLED_MASK,
    ENABLED_PATTERN,
    POWERED,
    TO_OPERATION_ENABLED,
    TO_SWITCH_ON_DISABLED,
    decode_state,
)
from hil.master.errors import DriveStateError
from hil.master.link import Link, Tap
from hil.master.sdo import ObjectAccess
from hil.master.supervision import Supervision
from hil.network import Network, Node
from hil.network.cia import Controlword, DriveState, Index, NmtCommand
from ident.errors import BusError

_RAMP_TIME = 0.1
"""Time in which an orderly end takes the torques to zero [s]."""
_STOP_TIME = 2.0
"""Longest time that an emergency stop waits for the drives to come to rest [s]."""
_STANDSTILL = (0.0, 0.0, 0.0, 0.0)


class Master:
    """Brings the network up, exchanges torques for samples every cycle, and takes it down again.

    As a context manager it commissions nothing by itself; leaving it shuts down in order, or, when an error
    is on its way out, stops the drives at once.

    Args:
        bus: any python-can bus.
        clock: time of that bus.
        network: the network file.
        tap: sees every frame; the recorder.
    """

    def __init__(self, bus: can.BusABC, clock: Clock, network: Network, tap: Tap | None = None) -> None:
        self._network = network
        self._link = Link(bus, clock, tap)
        timeout = network.times["sdo_timeout"]
        self._access = {node.node_id: ObjectAccess(self._link, node, timeout) for node in network.nodes}
        self._cycle = Cycle(self._link, clock, network)
        self._supervision = Supervision(self._link, network)
        self._torques: Sequence[float] = _STANDSTILL
        self._started = False
        self._enabled = False

    @property
    def overruns(self) -> int:
        """Cycles that began more than one period late."""
        return self._cycle.overruns

    @property
    def drive_states(self) -> tuple[DriveState | None, ...]:
        """States of the drives fl, rl, fr, rr at the last SYNC."""
        return tuple(decode_state(word) for word in self._cycle.statuswords)

    def object_access(self, node: Node) -> ObjectAccess:
        """SDO access to a node."""
        return self._access[node.node_id]

    def check(self) -> None:
        """Reset all nodes and see that they are the ones described; nothing is changed in them.

        Raises:
            BusError: a node is missing, another device, in other units, or without the mode (see `errors`).
        """
        commissioning.await_boot_up(self._link, self._network.nodes, self._network.times["boot_timeout"])
        for node in self._network.nodes:
            commissioning.check_identity(self._access[node.node_id])
        for node in self._network.drives:
            commissioning.check_drive(self._access[node.node_id])
        for node in self._network.encoders:
            commissioning.check_encoder(self._access[node.node_id])

    def boot(self) -> None:
        """Check, configure PDOs, heartbeats and mode by SDO, and start all nodes; the drives stay without power.

        From here on `exchange` has to be called every cycle: nodes that miss the master's heartbeat trip. For a
        pause, `shut_down` and `boot` again.

        Raises:
            BusError: as `check`, and when a node refuses its configuration.
        """
        self.check()
        for node in self._network.nodes:
            commissioning.configure(self._access[node.node_id], self._network)
        for node in self._network.drives:
            commissioning.select_mode(self._access[node.node_id])
        self._command_nmt(NmtCommand.START)
        self._cycle.resume()
        self._supervision.start(self._cycle.time)
        self._started = True
        self._exchange(_STANDSTILL)

    def enable(self) -> None:
        """Walk every drive to operation enabled, at zero torque.

        Raises:
            DriveStateError: a drive does not get there in time.
        """
        self._walk(TO_OPERATION_ENABLED, DriveState.OPERATION_ENABLED)
        self._enabled = True

    def exchange(self, motor_torques: Sequence[float]) -> Sample:
        """One cycle: command torques, SYNC, and the sample taken at it.

        Args:
            motor_torques: (4,) motor torques fl, rl, fr, rr [Nm], vehicle signs; they act from this SYNC on.

        Raises:
            DriveStateError: a drive has a fault or is not enabled.
            NodeLostError: a node has fallen silent or left the state operational.
        """
        sample = self._exchange(motor_torques)
        for number, word in enumerate(self._cycle.statuswords):
            if word & ENABLED_MASK != ENABLED_PATTERN:
                raise self._state_error(self._network.drives[number], word, "has left operation enabled and")
        return sample

    def disable(self) -> None:
        """Take the torques to zero in a ramp, then walk every drive to switch-on disabled.

        Raises:
            DriveStateError: a drive does not get there in time.
        """
        if self._enabled:
            steps = round(_RAMP_TIME / self._network.cycle_period)
            start = tuple(self._torques)
            for step in range(steps - 1, -1, -1):
                self.exchange([torque * step / steps for torque in start])
        self._walk(TO_SWITCH_ON_DISABLED, DriveState.SWITCH_ON_DISABLED)
        self._enabled = False

    def shut_down(self) -> None:
        """Disable the drives in order, stop the heartbeat supervision, and leave all nodes pre-operational."""
        if not self._started:
            return
        self.disable()
        for access in self._access.values():
            # The master's heartbeat ends now; the nodes must not take that for an accident.
            access.write(Index.CONSUMER_HEARTBEAT_TIME, 1, 0)
        self._command_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        self._started = False

    def emergency_stop(self) -> None:
        """Quick stop for every drive, whoever still answers and whether or not it can be recorded; when all that
        answer are without power, or after two seconds, all nodes pre-operational.
        """
        for command in self._cycle.commands:
            command.set_torque(0.0)
            command.set_controlword(Controlword.QUICK_STOP)
        with self._link.record_may_fail(), self._cycle.watching():
            for _ in range(round(_STOP_TIME / self._network.cycle_period)):
                # A frame that the interface refuses now may pass a cycle later.
                with contextlib.suppress(BusError):
                    self._cycle.sync_only()
                with contextlib.suppress(BusError):
                    self._supervision.tick(self._cycle.time)
                if not POWERED.intersection(self.drive_states):
                    break
            with contextlib.suppress(BusError):
                self._command_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        self._started = self._enabled = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self._stop_if_started()
            return
        try:
            self.shut_down()
        except BaseException:
            self._stop_if_started()
            raise

    def _stop_if_started(self) -> None:
        if self._started:
            self.emergency_stop()

    def _exchange(self, motor_torques: Sequence[float]) -> Sample:
        self._torques = motor_torques
        sample = self._cycle.exchange(motor_torques)
        self._supervision.tick(sample.time)
        return sample

    def _walk(self, controlwords: Mapping[DriveState, int], target: DriveState) -> None:
        self._exchange(_STANDSTILL)
        for _ in range(round(self._network.times["state_timeout"] / self._network.cycle_period)):
            states = self.drive_states
            if all(state is target for state in states):
                return
            for command, state in zip(self._cycle.commands, states, strict=True):
                command.set_controlword(controlwords.get(state, 0) if state is not None else 0)
            self._exchange(_STANDSTILL)
        for node, word in zip(self._network.drives, self._cycle.statuswords, strict=True):
            if decode_state(word) is not target:
                raise self._state_error(node, word, f"does not reach {target.label} and")

    def _command_nmt(self, command: int) -> None:
        for node in self._network.nodes:
            self._link.send_message(0, bytes((command, node.node_id)))

    def _state_error(self, node: Node, statusword: int, what: str) -> DriveStateError:
        # The other drives go on with their last torque while the question about the error code is on its way.
        self._stop_if_started()
        state = decode_state(statusword)
        label = state.label if state is not None else "in no known state"
        return DriveStateError(
            f"{node.label} {what} is {label} (statusword {statusword:04X}h, error code 603Fh {self._error_code(node)}"
            f"{self._supervision.emergency(node)}).",
            "Look the error code up in the drive's manual, remove the cause and start again.",
        )

    def _error_code(self, node: Node) -> str:
        """What 603Fh holds; a drive that does not tell must not hide the state that it is in."""
        try:
            return f"= {self._access[node.node_id].read(Index.ERROR_CODE):04X}h"
        except BusError:
            return "cannot be read"
