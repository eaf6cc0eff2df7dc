"""Opens damaged files, one after the other, in a process that has little memory, and says what came of each.

It says when it is ready; then a line of JSON comes in on standard input for each file (kind, path, truth) and one goes
out (`Outcome`).
"""

from __future__ import annotations

import io
import json
import resource
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hil.campaign.folder import open_run
from hil.campaign.reading import read_logs
from hil.network import load_network
from ident.errors import UserError
from ident.parameters_file import read_model
from ident.records.files import read_record
from ident.records.record import Record
from ident.vehicle.description import load_vehicle

READY = "ready"


@dataclass
class Outcome:
    """What came of a file.

    Attributes:
        how: `refused`, `answered` or `broken` (an error that is not the user's).
        what: the error, in the words of the user or as a traceback.
        differs: what is answered is not what is true.
        signs: how a user sees that.
        worst: of a difference without a sign: the largest, in the usual distance of a sample from its neighbours; the
            three samples at each end aside.
        seconds: that it took.
    """

    how: str
    what: str = ""
    differs: bool = False
    signs: tuple[str, ...] = ()
    worst: float = 0.0
    seconds: float = 0.0


def signs_of_doubt(record: Record, rows: int) -> tuple[str, ...]:
    """How a user sees that a record is not what was driven. An assessment of it belongs here, by its verdict."""
    read = sum(len(segment) for segment in record.segments)
    return (*record.notes, *([f"{read} rows of {rows}"] if read != rows else []))


def _judged(record: Record, truth: Path) -> Outcome:
    true = np.load(truth)
    signs = signs_of_doubt(record, len(true["time"]))
    values = np.vstack(
        [np.hstack([part.motor_torques, part.wheel_angles, part.steering_angles]) for part in record.segments]
    )
    if signs or len(record.segments) != 1:
        return Outcome("answered", "", True, signs or ("cut in pieces",))
    off = np.abs(values - true["values"]) / _usual(true["values"])
    # The first three and the last three samples have too few neighbours to be told by.
    return Outcome("answered", "", bool(np.max(off) > 0), (), float(np.max(off[3:-3])))


def _usual(values: np.ndarray) -> np.ndarray:
    """The largest distance of 95 % of the samples from the cubic through their neighbours, by column."""
    around = -values[:-4] + 4.0 * values[1:-3] + 4.0 * values[3:-1] - values[4:]
    return np.maximum(np.quantile(np.abs(values[2:-2] - around / 6.0), 0.95, axis=0), 1e-6)


def _of_log(path: Path, truth: Path) -> Outcome:
    return _judged(read_logs([path], load_network()), truth)


def _of_record(path: Path, truth: Path) -> Outcome:
    return _judged(read_record(path), truth)


def _of_settings(load: Callable[[Path], Any], name: str | None = None) -> Callable[[Path, Path], Outcome]:
    """Settings that are other numbers are other settings: whether they fit together, other checks say."""

    def answer(path: Path, _truth: Path) -> Outcome:
        load(path if name is None else path.with_name(name))
        return Outcome("answered")

    return answer


OPENERS: Mapping[str, Callable[[Path, Path], Outcome]] = {
    "log": _of_log,
    "record": _of_record,
    "vehicle": _of_settings(load_vehicle),
    "network": _of_settings(load_network, "network.toml"),
    "run": _of_settings(lambda path: open_run(path.parent)),
    "model": _of_settings(read_model),
}


def opened(kind: str, path: Path, truth: Path) -> Outcome:
    """Open a file and judge what comes of it."""
    start = time.perf_counter()
    try:
        outcome = OPENERS[kind](path, truth)
    except UserError as error:
        outcome = Outcome("refused", f"{error.what} {error.remedy}")
    except Exception:  # noqa: BLE001  # what this is about: an error of any other kind is a finding
        outcome = Outcome("broken", traceback.format_exc())
    outcome.seconds = time.perf_counter() - start
    return outcome


def main() -> None:
    """Serve until standard input ends; the argument is the memory that may be mapped [bytes]."""
    limit = int(sys.argv[1])
    import asammdf  # so that its own memory is not counted to the first file
    import pyarrow

    del asammdf, pyarrow
    answers = sys.stdout
    sys.stdout = sys.stderr = said = io.StringIO()
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    print(READY, flush=True, file=answers)
    for line in sys.stdin:
        order = json.loads(line)
        outcome = opened(order["kind"], Path(order["path"]), Path(order["truth"]))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        print(json.dumps({**asdict(outcome), "peak": peak, "said": said.getvalue()}), flush=True, file=answers)
        said.seek(0)
        said.truncate()


if __name__ == "__main__":
    main()
