"""The diagnosis of servo axes on published records of real machines, against an answer found without it.

    python examples/published_machines.py ~/published                # all machines of which there is a copy
    python examples/published_machines.py ~/published kr300 tx40     # some
    python examples/published_machines.py --sources                  # where the records are

The folder, or QUASIOMNI_PUBLISHED, holds one copy of each repository: `git clone ADDRESS` in it. What is expected of a
row is what `held_out_laws.py` found before the diagnosis was run: all laws within a tenth of the one that closes most
of the held-out gap, or none where none closes 0.12 of it. Two rows are judged by hand: of the mill the model is worse
than no model on held-out data, and the HSM150 turns in one direction only, so nothing can be said of either.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from published_outcomes import (
    ASYMMETRY,
    FRICTION_ANGLE,
    GRAVITY,
    INERTIA,
    NONE,
    PERIODIC,
    SPEED,
    TIME,
    Outcome,
    Row,
    outcome_of,
    words,
)
from published_records import MACHINES, record

from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.check.fitted import HeldOut
from ident.errors import UserError
from ident.records.axis_record import AxisRecord

Array = NDArray[np.float64]

FOLDER: Final = "QUASIOMNI_PUBLISHED"
"""Environment variable: folder of the copies."""
SEED: Final = 1


@dataclass(frozen=True)
class Result:
    """What came out of a row.

    Attributes:
        outcome: against what was expected.
        answer: in words.
        stated: probability of its first name; NaN without one.
        before, after: held-out gap over noise.
        predicted: share of the mean square of the held-out effort that the model misses which its causes take away;
            no estimate of a noise is in that, so that it compares one diagnosis with another.
        seconds: of the processor.
    """

    outcome: Outcome
    answer: str
    stated: float
    before: float
    after: float
    predicted: float
    seconds: float


def _alone(expected: tuple[str, ...], closed: float) -> tuple[Mapping[str, tuple[str, ...]], Mapping[str, float]]:
    return {"axis": expected}, {"axis": closed}


_KUKA: Final = "data/recorded_trajectories/2020-10-21 10s FF {} 08ms/data.mat"
_KUKA_FILES: Final = ((_KUKA.format("A"), _KUKA.format("C")), (_KUKA.format("B"),), 10.0)
_TX40: Final = (("examples/staubli_TX40/data/pos_read_data.csv",), (), 25.0)
_TIAGO: Final = (("examples/tiago/data/identification/dynamic/tiago_position.csv",), (), 4.0)
_DOUBLE: Final = "data/experiment_records/{}/sys_id/trajectory_{:02d}.csv"
_SIMPLE: Final = "results/control_method_{}/data_measured.csv"
_SCREW: Final = "actuators/{}/data/{}pp-sine-sweep-10mm-0.5Hz.txt"
_PANDA: Final = "Comparative data/Franka Robot/case3_{}.csv"
_MILL: Final = "data/experiment_{:02d}.csv"
_HSM: Final = "Data/Identification/idf_neg_{}_1.mat"

ROWS: Final = (
    Row("kr300", "joint 1", ("1",), *_KUKA_FILES, *_alone(TIME, 0.47)),
    Row("kr300", "joint 2", ("2",), *_KUKA_FILES, *_alone((*TIME, *SPEED), 0.31)),
    Row("kr300", "joint 3", ("3",), *_KUKA_FILES, *_alone((*GRAVITY, "law time"), 0.40)),
    Row("kr300", "joint 4", ("4",), *_KUKA_FILES, *_alone((NONE,), 0.07)),
    Row("kr300", "joint 5", ("5",), *_KUKA_FILES, *_alone((*INERTIA, "law time"), 0.37)),
    Row("kr300", "joint 6", ("6",), *_KUKA_FILES, *_alone((*TIME, *SPEED), 0.19)),
    Row(
        "kr300",
        "joints 1 to 6",
        ("1", "2", "3", "4", "5", "6"),
        *_KUKA_FILES,
        {
            "axis_1": INERTIA,
            "axis_2": SPEED,
            "axis_3": (*GRAVITY, "law time"),
            "axis_4": (NONE,),
            "axis_5": (*INERTIA, *SPEED),
            "axis_6": (*TIME, *SPEED),
        },
        {"axis_1": 0.44, "axis_2": 0.39, "axis_3": 0.52, "axis_4": 0.05, "axis_5": 0.19, "axis_6": 0.17},
    ),
    Row("tx40", "joint 1", ("1",), *_TX40, *_alone((NONE,), 0.08)),
    Row("tx40", "joint 2", ("2",), *_TX40, *_alone((*GRAVITY, *INERTIA), 0.69)),
    Row("tx40", "joint 3", ("3",), *_TX40, *_alone(INERTIA, 0.49)),
    Row("tx40", "joint 4", ("4",), *_TX40, *_alone(PERIODIC, 0.43)),
    Row("tx40", "joint 5", ("5",), *_TX40, *_alone(FRICTION_ANGLE, 0.15)),
    Row(
        "tx40",
        "joints 1 to 4",
        ("1", "2", "3", "4"),
        *_TX40,
        {"axis_1": INERTIA, "axis_2": GRAVITY, "axis_3": (*SPEED, *ASYMMETRY, *GRAVITY), "axis_4": PERIODIC},
        {"axis_1": 0.45, "axis_2": 0.77, "axis_3": 0.32, "axis_4": 0.45},
    ),
    Row("tiago_torso", "lift", ("torso",), *_TIAGO, *_alone((*GRAVITY, NONE), 0.12)),
    Row(
        "tiago",
        "joint 1",
        ("arm_1",),
        *_TIAGO,
        *_alone((*ASYMMETRY, *TIME, "friction_load", "law load x direction"), 0.18),
    ),
    Row("tiago", "joint 2", ("arm_2",), *_TIAGO, *_alone(GRAVITY, 0.74)),
    Row("tiago", "joint 3", ("arm_3",), *_TIAGO, *_alone(GRAVITY, 0.43)),
    Row("tiago", "joint 4", ("arm_4",), *_TIAGO, *_alone(GRAVITY, 0.44)),
    Row(
        "tiago",
        "joints 1 to 4",
        ("arm_1", "arm_2", "arm_3", "arm_4"),
        *_TIAGO,
        {"axis_arm_1": (*ASYMMETRY, *PERIODIC), "axis_arm_2": GRAVITY, "axis_arm_3": GRAVITY, "axis_arm_4": GRAVITY},
        {"axis_arm_1": 0.28, "axis_arm_2": 0.80, "axis_arm_3": 0.53, "axis_arm_4": 0.78},
    ),
    Row(
        "double_pendulum",
        "design A",
        ("1", "2"),
        (_DOUBLE.format("design_A.0/20220815", 2),),
        (_DOUBLE.format("design_A.0/20220815", 3),),
        15.0,
        {"axis_1": (NONE,), "axis_2": GRAVITY},
        {"axis_1": 0.05, "axis_2": 0.81},
    ),
    Row(
        "double_pendulum",
        "design C",
        ("1", "2"),
        (_DOUBLE.format("design_C.0/20220914", 2),),
        (_DOUBLE.format("design_C.0/20220914", 1),),
        15.0,
        {"axis_1": (*GRAVITY, "presliding", "law path_since_reversal x direction"), "axis_2": GRAVITY},
        {"axis_1": 0.55, "axis_2": 0.40},
    ),
    Row(
        "double_pendulum",
        "design A, slow",
        ("1", "2"),
        ("data/experiment_records/design_A.0/20220812/sys_id/20220812-061157-PM_measured.csv",),
        (),
        6.0,
        {"axis_1": GRAVITY, "axis_2": GRAVITY},
        {"axis_1": 1.0, "axis_2": 0.98},
    ),
    Row(
        "simple_pendulum",
        "swings up",
        ("1",),
        (_SIMPLE.format("ddp"),),
        (_SIMPLE.format("direct_collocation"),),
        6.0,
        *_alone(GRAVITY, 1.0),
    ),
    Row(
        "simple_pendulum",
        "moved by hand",
        ("1",),
        (_SIMPLE.format("gravity_compensation"),),
        (),
        5.0,
        *_alone(GRAVITY, 1.0),
    ),
    Row(
        "linear_actuator",
        "LinA",
        ("1",),
        (_SCREW.format("LinA", ""),),
        (_SCREW.format("LinA", "no-"),),
        12.0,
        *_alone((NONE,), 0.08),
    ),
    Row("linear_actuator", "LinD", ("1",), (_SCREW.format("LinD", "no-"),), (), 12.0, *_alone((*TIME, *SPEED), 0.63)),
    Row(
        "panda",
        "joint 2",
        ("1",),
        (_PANDA.format("middle"),),
        (_PANDA.format("high"),),
        10.0,
        *_alone((*GRAVITY, *PERIODIC), 0.25),
    ),
    Row(
        "mill",
        "X and Y",
        ("X", "Y"),
        (_MILL.format(1),),
        (_MILL.format(2),),
        2.0,
        {"axis_X": (NONE,), "axis_Y": (NONE,)},
        {"axis_X": 0.0, "axis_Y": 0.0},
    ),
    Row(
        "hsm150", "one direction", ("1",), (_HSM.format("0.04"),), (_HSM.format("0.045"),), 10.0, *_alone((NONE,), 0.0)
    ),
)


def read_row(row: Row, folder: Path) -> tuple[list[AxisRecord], list[AxisRecord]]:
    """Records to fit and to confirm of a row.

    Raises:
        UserError: a file is missing, with where to get it.
    """
    machine = MACHINES[row.machine]
    for file in (*row.fit, *row.confirm):
        if not (folder / machine.folder / file).is_file():
            raise UserError(
                f"{folder / machine.folder / file} is missing.", f"In {folder}: git clone {machine.address}"
            )
    fit, confirm = (
        [record(machine.read(folder / machine.folder / file), row.axes, file) for file in files]
        for files in (row.fit, row.confirm)
    )
    return fit, confirm


def result_of(row: Row, fit: Sequence[AxisRecord], confirm: Sequence[AxisRecord]) -> Result:
    """Diagnose a row."""
    start, nothing = time.process_time(), float("nan")
    try:
        findings = diagnose_axis(fit, confirm, seed=SEED)
    except UserError as error:
        return Result(Outcome.REFUSED, str(error), nothing, nothing, nothing, nothing, time.process_time() - start)
    diagnosis, seconds = findings.diagnosis(), time.process_time() - start
    before, after = diagnosis.gap.before / diagnosis.gap.floor, diagnosis.gap.after / diagnosis.gap.floor
    predicted = predicted_share(findings.held_out)
    stated = diagnosis.effects[0].probability if diagnosis.effects else nothing
    return Result(outcome_of(row, diagnosis), words(row, diagnosis), stated, before, after, predicted, seconds)


def predicted_share(held_out: HeldOut) -> float:
    """What causes take away of the mean square that the model without them misses, in the held-out rows."""

    def missed(models: Sequence[Array]) -> float:
        blocks = held_out.problem.blocks
        return sum(
            float(np.sum((block.target - model)[block.moving] ** 2))
            for block, model in zip(blocks, models, strict=True)
        )

    return 1 - missed(held_out.after) / missed(held_out.before)


def _expectation(row: Row) -> str:
    return "; ".join(
        f"{place if len(row.expected) > 1 else ''} {' or '.join(causes)} ({row.closed[place]:.2f})".strip()
        for place, causes in row.expected.items()
    )


def lines(folder: Path, machines: Sequence[str]) -> Iterator[str]:
    """The table, a row a line, as Markdown; rows without records say where to get them."""
    yield "| machine | expected (closes) | answer (closes) | outcome | stated | gap over noise | predicts | time |"
    yield "|---|---|---|---|---|---|---|---|"
    for row in ROWS:
        if machines and row.machine not in machines:
            continue
        name = f"{row.machine}, {row.title}"
        try:
            fit, confirm = read_row(row, folder)
        except UserError as error:
            yield f"| {name} | {_expectation(row)} | skipped: {error} | | | | | |"
            continue
        result, answered = result_of(row, fit, confirm), ("", "", "")
        if result.outcome is not Outcome.REFUSED:
            stated = "" if math.isnan(result.stated) else f"{result.stated:.2f}"
            answered = (stated, f"{result.before:.2f}, then {result.after:.2f}", f"{result.predicted:.2f}")
        cells = (name, _expectation(row), result.answer, result.outcome.value, *answered, f"{result.seconds:.0f} s")
        yield f"| {' | '.join(cells)} |"


def sources() -> Iterator[str]:
    """Where the records are, how they are licensed and what is done to them, as Markdown."""
    yield "| machine | what | repository | licence | conversion |"
    yield "|---|---|---|---|---|"
    for name, machine in MACHINES.items():
        yield f"| {name} | {machine.what} | {machine.address} | {machine.licence} | {machine.conversion} |"


def main() -> None:
    """Print the table, or the sources."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=os.environ.get(FOLDER), help=f"or {FOLDER}")
    parser.add_argument("machines", nargs="*", help="of which machines, all by default")
    parser.add_argument("--sources", action="store_true", help="print where the records are")
    given = parser.parse_args()
    if given.folder is None and not given.sources:
        parser.error(f"Name the folder of the copies, or set {FOLDER}.")
    for line in sources() if given.sources else lines(Path(given.folder), given.machines):
        print(line, flush=True)


if __name__ == "__main__":
    main()
