"""What `doctor --real-time` measures and shows: how late cycles are on this computer, and why."""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import typer
from rich import box
from rich.table import Table

from ident.extras import require_engine
from ident.writing import refuse_folder, write_by
from quasiomni.application import console
from quasiomni.options import say_urgency
from quasiomni.showing import say

if TYPE_CHECKING:
    from hil.bench.real_time import Measured

PERIOD: Final = 0.002
"""Of the shipped network [s]."""

ALLOWED: Final = 0.001
"""Share of cycles that may be late beyond those of the loop that only sleeps."""


def try_real_time(seconds: float, trace: Path | None, *, priority: bool, as_json: bool) -> bool:
    """Measure, and show what came of it; whether cycles are on time.

    Args:
        seconds: of each of both.
        trace: where the late cycles are written.
        priority: whether the loops may have real-time priority.
        as_json: print JSON.

    Raises:
        UserError: the emulator is missing, or a file cannot be written.
    """
    require_engine(None, "--real-time")
    if trace is not None:
        refuse_folder(trace)
    from hil.bench.lateness import write_late_cycles
    from hil.bench.real_time import Trial, measure  # needs the emulator, which a vehicle's computer does not have

    server = (sys.executable, "-m", "quasiomni", "emulate", "--priority" if priority else "--no-priority")

    def told(done: int, turns: int) -> None:
        if done < turns and not as_json:
            say([f"turn {done + 1} of {turns}: {'the emulated vehicle' if done % 2 else 'a loop that only sleeps'}"])

    measured = measure(Trial(server, round(seconds / PERIOD), priority=priority), told)
    if trace is not None:
        write_by(partial(write_late_cycles, measured.cycles), trace)
    if as_json:
        typer.echo(json.dumps(_as_json(measured), indent=1))
    else:
        _show(measured)
    bare, bench = measured.shares
    return bench - bare <= ALLOWED


def _as_json(measured: Measured) -> dict[str, object]:
    bare, bench = measured.shares
    return {
        "ok": bench - bare <= ALLOWED,
        "cycles": len(measured.bench),
        "late": {"bare": bare, "bench": bench},
        "quantiles_s": [{"share": share, "bare": bare, "bench": bench} for share, bare, bench in measured.quantiles()],
        "reasons": {str(reason): count for reason, count in measured.reasons.most_common()},
        "priority": measured.urgency.priority.name.lower(),
        "memory": measured.urgency.memory.name.lower(),
        "load": measured.load,
    }


def _show(measured: Measured) -> None:
    from hil.bench.lateness import MEANINGS

    bare, bench = measured.shares
    console.print(
        f"{len(measured.bench)} cycles of 2 ms each, {measured.urgency.what}; load of the computer {measured.load:.1f}",
        highlight=False,
        soft_wrap=True,
    )
    say_urgency(measured.urgency)
    table = Table("", "a loop that only sleeps", "the emulated vehicle", box=box.SIMPLE_HEAD)
    table.add_row("later than 1 ms", f"{bare:.3%}", f"{bench:.3%}")
    for share, of_bare, of_bench in measured.quantiles():
        name = f"{100 * share:g} % within" if share < 1 else "latest"
        table.add_row(name, f"{1e3 * of_bare:.2f} ms", f"{1e3 * of_bench:.2f} ms")
    console.print(table)
    if measured.cycles:
        reasons = Table("late because", "cycles", "that is", box=box.SIMPLE_HEAD)
        for reason, count in measured.reasons.most_common():
            reasons.add_row(str(reason), str(count), MEANINGS[reason])
        console.print(reasons)
