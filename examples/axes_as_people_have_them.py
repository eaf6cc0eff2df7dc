"""What becomes of records of axes without repeats: how many are refused, and how many get a wrong name.

    python examples/axes_as_people_have_them.py                    # 200 slow, short or mixed ones, from seed 60000 on
    python examples/axes_as_people_have_them.py --usual            # 200 usual ones: 3 to 35 s at 250 to 2000 Hz
    python examples/axes_as_people_have_them.py --first-seed 1 --count 30

Each is a record of another machine: a third slow (60 to 180 s, a tenth of the usual speed), a third short (two strokes
of 0.5 to 1.5 s), both confirmed by a part of themselves, and a third of mixed rates (another record, at a half or a
quarter of the rate, confirms); or all of them usual, confirmed by a part of themselves. Half of the machines lack
nothing; of the others one in nine, and the rest one of eight things (`hil/exam/sources/axes.py`). A name is wrong
where something else is missing and its set says nothing of that, and any name or law where nothing is.
"""

from __future__ import annotations

import argparse
import enum
import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil.exam.sources.axes import DrawnAxis, Lacking, draw_axis
from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.names import LAW
from ident.errors import UserError
from ident.records.axis_record import AxisRecord

NAMES = {
    Lacking.NOTHING: set[str](),
    Lacking.ASYMMETRY: {LAW, "asymmetric_viscous", "asymmetric_coulomb"},
    Lacking.DRAG: {LAW, "quadratic_drag", "stribeck"},
    Lacking.BRISTLES: {LAW, "stribeck", "presliding", "quadratic_drag"},
    Lacking.DELAY: {LAW, "time_delay", "torque_filter"},
    Lacking.SPRING: {LAW, "com_offset", "gravity_load", "torque_ripple", "slope"},
    Lacking.RIPPLE: {LAW, "torque_ripple", "com_offset"},
    Lacking.FRICTION: {LAW, "friction_position"},
    Lacking.SECOND_MASS: {LAW, "elasticity"},
}
"""What may rightly be said of a machine, beside `unknown`."""


FARTHEST = 100.0
"""Beyond which a machine runs away [m]."""


class Trouble(enum.StrEnum):
    """What is hard about a record."""

    SLOW = "slow"
    SHORT = "short"
    MIXED = "mixed rates"
    USUAL = "usual"


TROUBLED = (Trouble.SLOW, Trouble.SHORT, Trouble.MIXED)


@dataclass(frozen=True)
class Outcome:
    """Of one diagnosis.

    Attributes:
        trouble: of the record.
        lacking: what the machine lacks.
        said: verdict, or why it was refused.
        refused: there is no answer.
        wrong: names that are not what it lacks.
    """

    trouble: Trouble
    lacking: Lacking
    said: str
    refused: bool = False
    wrong: tuple[str, ...] = ()


Drawn = tuple[Trouble, DrawnAxis, Sequence[AxisRecord], Sequence[AxisRecord]]


def drawn(seed: int, troubles: Sequence[Trouble] = TROUBLED) -> Drawn:
    """Trouble, machine, records to fit and to confirm; of machines that run away at a rate, the next one."""
    machines = (_drawn(seed, attempt, troubles) for attempt in itertools.count())
    return next(found for found in machines if all(_follows(record) for record in (*found[2], *found[3])))


def _follows(record: AxisRecord) -> bool:
    """Whether an axis goes where it is told, within metres."""
    return bool(np.abs(record.axes[0].position).max() < FARTHEST)


def _drawn(seed: int, attempt: int, troubles: Sequence[Trouble]) -> Drawn:
    generator = np.random.default_rng([seed, 7, attempt] if attempt else [seed, 7])
    trouble = troubles[seed % len(troubles)]
    number = seed if not attempt else int(generator.integers(2**31))
    axis = draw_axis(number, Lacking.NOTHING if generator.random() < 0.5 else None)
    machine = axis.machine
    if trouble is Trouble.SLOW:
        speeds = tuple(0.1 * speed for speed in machine.speeds)
        machine = replace(machine, speeds=speeds, duration=float(generator.uniform(60, 180)), rate=250.0, substeps=16)
    elif trouble is Trouble.SHORT:
        machine = replace(machine, strokes=2, duration=float(generator.uniform(1.0, 3.0)))
    record = machine.drive(seed)
    if trouble is not Trouble.MIXED:
        return trouble, axis, [record], []
    factor = int(generator.choice([2, 4]))
    slower = replace(machine, rate=machine.rate / factor, substeps=machine.substeps * factor)
    return trouble, axis, [record], [slower.drive(seed + 1)]


def outcome_of(seed: int, troubles: Sequence[Trouble] = TROUBLED) -> Outcome:
    """Diagnose one."""
    trouble, axis, fit, confirm = drawn(seed, troubles)
    try:
        findings = diagnose_axis(fit, confirm, seed=1)
    except UserError as error:
        return Outcome(trouble, axis.lacking, str(error), refused=True)
    effects = findings.diagnosis().effects
    named = effects if findings.verdict is not Verdict.UNKNOWN else ()
    right = NAMES[axis.lacking]
    wrong = tuple(effect.name for effect in named if not right & {effect.name, *effect.ambiguity_set})
    return Outcome(trouble, axis.lacking, str(findings.verdict), wrong=wrong)


def outcomes(first_seed: int, count: int, troubles: Sequence[Trouble]) -> Iterator[Outcome]:
    """Of `count` seeds, one line each."""
    for seed in range(first_seed, first_seed + count):
        outcome = outcome_of(seed, troubles)
        print(seed, outcome.trouble, outcome.lacking, outcome.said, *outcome.wrong, sep=" | ", flush=True)
        yield outcome


def main() -> None:
    """Count what becomes of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first-seed", type=int, default=60000)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--usual", action="store_true", help="usual records in place of hard ones")
    arguments = parser.parse_args()
    troubles = (Trouble.USUAL,) if arguments.usual else TROUBLED
    found = list(outcomes(arguments.first_seed, arguments.count, troubles))
    for trouble in troubles:
        own = [one for one in found if one.trouble is trouble]
        refused, wrong = sum(one.refused for one in own), sum(bool(one.wrong) for one in own)
        print(f"{trouble}: {len(own)} records, {refused} refused, {wrong} with a wrong name")
    print(f"refused {sum(one.refused for one in found)} of {len(found)}, asked at most 0.1")
    print(f"wrong names {sum(bool(one.wrong) for one in found)} of {len(found)}, asked at most 0.05")
    print("refusals:", *Counter(one.said for one in found if one.refused).most_common(), sep="\n  ")


if __name__ == "__main__":
    main()
