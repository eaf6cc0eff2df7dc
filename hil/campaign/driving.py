"""Drives a planned campaign into its folder."""

from __future__ import annotations

from contextlib import suppress

import can

from hil.bus.clock import Clock
from hil.campaign.creating import create_run
from hil.campaign.folder import Run
from hil.campaign.inspection import Rejected, reject_unusable
from hil.campaign.order import Order
from hil.campaign.runner import CampaignRunner, Operator, Progress
from hil.frames.lockstep_time import SyncTime
from hil.frames.recorder import Recorder, finished_steps
from ident.errors import RecordError
from ident.vehicle.description import find_data_file


def keep_unusable_aside(run: Run) -> list[Rejected]:
    """Steps that were finished and cannot be used, for their log was damaged since or the run stopped before it was
    looked at: they are driven again.

    Raises:
        RecordError: a log cannot be renamed.
    """
    return reject_unusable(run, finished_steps(run.folder.frames))


def drive_run(
    run: Run,
    order: Order,
    bus: can.BusABC,
    clock: Clock,
    operator: Operator,
    progress: Progress,
    *,
    lockstep: bool = False,
    priority: bool = False,
) -> int:
    """Make the run folder where there is none yet, and drive; gives how many cycles began late.

    Whoever calls has the folder locked (`hil.campaign.lock`) and the network checked (`check_network`).

    Args:
        run, order: what to drive.
        bus, clock: of the vehicle.
        operator: lifts and lowers the vehicle.
        progress: called with the progress of each step.
        lockstep: SYNCs move the time of the other side, and wall time says nothing of its samples.
        priority: go before other programs while the drives are enabled, where that is permitted.

    Raises:
        UserError: a step failed or cannot be used; the drives are stopped.
    """
    if not order.resume:
        create_run(run, find_data_file("ident.vehicle", order.vehicle))
    stamp = SyncTime(run.network.sync_cob_id, run.network.cycle_period) if lockstep else None
    recorder = Recorder(run.folder.frames, order.log_format, stamp)
    try:
        runner = CampaignRunner(run, bus, clock, recorder, operator, progress, priority=priority)
        runner.drive()
    except BaseException:
        # The error that is on its way out is the one to report.
        with suppress(RecordError):
            recorder.close()
        raise
    recorder.close()
    return runner.overruns
