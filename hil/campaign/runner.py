"""Drives the steps of a plan through a master, one log a step, and goes on where a killed run stopped.

The same code drives the emulator and a real vehicle: it sees a bus, a clock and an operator.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Final, Protocol

import can
import numpy as np
from numpy.typing import NDArray

from hil.bus.clock import Clock
from hil.bus.realtime import steady_memory
from hil.bus.urgency import urgent
from hil.campaign.folder import Run
from hil.campaign.inspection import refusal, reject_unusable
from hil.campaign.reading import read_run
from hil.frames import LONGEST_GAP
from hil.frames.recorder import finished_steps
from hil.master.master import Master
from hil.network import Network
from ident.assessment import Verdict, assess
from ident.campaign.controller import Controller
from ident.campaign.reference import Reference
from ident.campaign.steps import LOADED
from ident.errors import CampaignError, EstimationError
from ident.estimate.identify import FIT_STEPS, identify
from ident.faults import find_faults
from ident.records.record import Step, base_step
from ident.vehicle.parameters import Parameters

ALIGNED: Final = 1.5e-4
"""Steering error that needs no further alignment [rad], three increments of a 17-bit encoder: wheels that point to
different centres slip, and half a milliradian already adds one per cent to the viscous friction that is found."""

PARALLEL: Final = 1e-4
"""Difference of the errors of both sides that needs no further alignment [rad], two increments. An error that both
share only turns the motion; another makes the wheels slide, and from 0.2 mrad on they push the steering aside. Across,
where either does, it is no worse than `ALIGNED`."""

READINGS = 25
"""Cycles over which the steering is read at standstill: a single reading scatters by half an increment."""

ALIGNMENTS: Final = 12
"""Attempts at an alignment. Each leaves the sides apart by more than `PARALLEL` in four of ten, so that of 6 attempts
one campaign in fifty drove on with wheels that push each other, and with a friction that its interval does not hold."""

MISALIGNED: Final = 0.01
"""Steering error after the last attempt with which no step is begun [rad]."""


class Session(enum.IntEnum):
    """Steps between which the drives lose their power: to move or load the vehicle by hand, and to identify before
    validating.
    """

    LIFTED = 0
    FLOOR = 1
    LOADED = 2
    VALIDATION = 3


PROGRESS_CYCLES: Final = 100
_STANDSTILL: Final = (0.0, 0.0, 0.0, 0.0)

Progress = Callable[[str, int, int], None]
"""Called with step, cycles driven and cycles to drive; an alignment is called `aligning for STEP, attempt N of M`."""


class StepRecorder(Protocol):
    """Takes every frame, one log a step."""

    def __call__(self, message: can.Message) -> None:
        """Take a frame."""

    def step(self, name: str) -> AbstractContextManager[object]:
        """The frames inside belong to this step."""

    def settle(self) -> None:
        """Return when every finished step is where it can be read."""


class Operator(Protocol):
    """Hands beside the vehicle; called while its drives are without power."""

    def lift(self) -> None:
        """Put the vehicle on the jack-stand, wheels free, and return when it is there."""

    def lower(self) -> None:
        """Put the vehicle on the floor, wheels about straight ahead, and return when it is there."""

    def load(self, mass: float) -> None:
        """Put a load [kg] on the vehicle, over its centre, and return when it is fixed."""

    def unload(self) -> None:
        """Take the load off, and return when that is done."""


def check_network(bus: can.BusABC, clock: Clock, network: Network) -> None:
    """See that all nodes are the ones described; nothing moves.

    Raises:
        BusError: a node is missing, another device, in other units, or without the mode.
    """
    Master(bus, clock, network).check()


def session_of(step: str) -> Session:
    """The session in which a step is driven."""
    if base_step(step) is Step.WHEEL_LIFTED:
        return Session.LIFTED
    if step in LOADED:
        return Session.LOADED
    return Session.VALIDATION if step == Step.LANE_CHANGE else Session.FLOOR


class CampaignRunner:
    """Drives a run.

    Args:
        run: what to drive.
        bus: of the vehicle.
        clock: time of that bus.
        recorder: takes every frame.
        operator: lifts and lowers the vehicle.
        progress: shown to people.
        spare_alignments: leave out an alignment where the wheels stand right already.
        priority: go before other programs while the drives are enabled, where that is permitted.
    """

    def __init__(
        self,
        run: Run,
        bus: can.BusABC,
        clock: Clock,
        recorder: StepRecorder,
        operator: Operator,
        progress: Progress,
        *,
        spare_alignments: bool = False,
        priority: bool = False,
    ) -> None:
        self._run = run
        self._plan = run.plan
        self._bus = bus
        self._clock = clock
        self._recorder = recorder
        self._operator = operator
        self._progress = progress
        self._spare_alignments = spare_alignments
        self._priority = priority
        self.overruns = 0

    def drive(self) -> None:
        """Drive all steps that are not finished yet.

        Raises:
            BusError: the network fails on the way; the drives are stopped.
            CampaignError: a coordinate leaves its reference or cannot be aligned, or a step cannot be used; the drives
                are stopped.
        """
        finished = {step for step, _ in finished_steps(self._run.folder.frames)}
        # A killed run may have left the vehicle on its stand or loaded, so a resumed one asks for floor and unloading.
        maybe_lifted = Step.WHEEL_LIFTED in self._plan.steps
        maybe_loaded = any(step in LOADED and step in finished for step in self._plan.steps)
        for session in Session:
            steps = [step for step in self._plan.steps if session_of(step) is session and step not in finished]
            if not steps:
                continue
            if session is Session.LIFTED:
                self._operator.lift()
            elif maybe_lifted:
                self._operator.lower()
                maybe_lifted = False
            if session is Session.LOADED:
                self._operator.load(self._run.payload)
                maybe_loaded = True
            elif maybe_loaded and session is Session.VALIDATION:
                self._operator.unload()
            self._drive_session(steps)

    def _master(self) -> Master:
        return Master(self._bus, self._clock, self._run.network, self._recorder)

    def _drive_session(self, steps: Sequence[str]) -> None:
        """Boot, drive some steps, shut down, and see whether they can be used. Whatever takes long is computed before
        or after: enabled drives want a SYNC.
        """
        before = set(finished_steps(self._run.folder.frames))
        references = [self._plan.reference(step, self._parameters(step)) for step in steps]
        with steady_memory(), urgent(self._priority), self._master() as master:
            master.boot()
            master.enable()
            for reference in references:
                if session_of(reference.step) is not Session.LIFTED:
                    self._align(master, reference.step)
                self._drive(master, reference)
        self.overruns += master.overruns
        self._recorder.settle()
        driven = [log for log in finished_steps(self._run.folder.frames) if log not in before]
        if (refused := refusal(reject_unusable(self._run, driven))) is not None:
            raise refused

    def _align(self, master: Master, step: str) -> None:
        target = self._plan.posture(step)
        for attempt in range(1, ALIGNMENTS + 1):
            start = _steering_at_rest(master)
            if self._spare_alignments and _aligned(start - target):
                return
            alignment = self._plan.alignment(start, step, self._plan.vehicle.prior)
            self._drive(master, alignment, f"aligning for {step}, attempt {attempt} of {ALIGNMENTS}")
            reached = _steering_at_rest(master)
            if _aligned(reached - target):
                return
        error = float(np.abs(reached - target).max())
        if error > MISALIGNED:
            raise CampaignError(
                f"The wheels stand {error:.3f} rad off the angles of {step} after {ALIGNMENTS} alignments.",
                "Look for a blocked steering unit, or give its friction in the vehicle file's [prior].",
            )

    def _drive(self, master: Master, reference: Reference, shown: str = "") -> None:
        """Drive one reference into a log of its own; shown to people as the step that it is, or as something else."""
        vehicle = self._plan.vehicle
        controller = Controller(
            reference,
            self._plan.designs,
            self._plan.limits,
            gear_ratio=vehicle.geometry.gear_ratio,
            peak_torque=vehicle.limits.peak_torque,
        )
        total, torques = len(reference), controller.torques
        longest = (LONGEST_GAP + 1.5) * self._plan.cycle
        with self._recorder.step(reference.step):
            sample = master.exchange(_STANDSTILL)
            for index in range(total - 1):
                last = sample.time
                sample = master.exchange(torques(index, sample.wheel_angles, sample.steering_angles))
                if sample.time - last > longest:
                    raise _too_late(reference.step, sample.time - last, self._plan.cycle)
                if index % PROGRESS_CYCLES == 0:
                    self._progress(shown or reference.step, index, total)
        self._progress(shown or reference.step, total, total)

    def _parameters(self, step: str) -> Parameters:
        """Feed-forward by the guesses, and for the validation by what the steps before it have shown, where that can
        be true: a vehicle is not driven by what is not.
        """
        vehicle = self._plan.vehicle
        if step != Step.LANE_CHANGE or not self._identifiable():
            return vehicle.prior
        record = read_run(self._run.folder.path)
        try:
            result = identify(record, vehicle.geometry, known_inertia=self._run.known_inertia)
        except EstimationError:
            return vehicle.prior
        if assess(result, record, vehicle, find_faults(record, vehicle)).verdict is Verdict.UNUSABLE:
            return vehicle.prior
        return result.parameters

    def _identifiable(self) -> bool:
        finished = {step for step, _ in finished_steps(self._run.folder.frames)}
        needed = {str(step) for step in FIT_STEPS if step is not Step.LATERAL}
        return needed <= finished and (self._run.known_inertia is not None or Step.WHEEL_LIFTED in finished)


def _too_late(step: str, time: float, cycle: float) -> CampaignError:
    """Said at once: what is driven after such a gap could not be used."""
    return CampaignError(
        f"{step} cannot be used: the master left out {round(time / cycle) - 1} cycles in a row, {LONGEST_GAP} can be "
        "interpolated.",
        "Close other programs on this computer, and drive the step again (--resume).",
    )


def _steering_at_rest(master: Master) -> NDArray[np.float64]:
    """Steering angles (2,) of wheels that stand [rad]."""
    readings = [master.exchange(_STANDSTILL).steering_angles for _ in range(READINGS)]
    return np.asarray(np.mean(readings, axis=0))


def _aligned(errors: NDArray[np.float64]) -> bool:
    """Whether steering errors (2,) [rad] are so small that the wheels roll."""
    return float(np.abs(errors).max()) < ALIGNED and abs(float(errors[0] - errors[1])) < PARALLEL
