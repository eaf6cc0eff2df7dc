"""Names of the numbers of a score, and what is asked of them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

CLOSES: Final = 0.8
"""Share of the removable gap that the right effect is to close."""
CLOSES_NOT: Final = 0.2
"""Share that a wrong one must stay below."""

RIGHT_LARGE: Final = "size 0.5 and above: right (first name, or the exact set where no record splits it)"
RIGHT_APART: Final = "- of them, where the experiment can split: first name"
RIGHT_SET: Final = "- of them, where it cannot: exact set"
COVERED_LARGE: Final = "size 0.5 and above: true name in the set, no answer counted as a miss"
COVERED_NAMED: Final = "- of them, where a name is given"
SET_SIZE: Final = "size 0.5 and above: mean size of the set"
RIGHT_SMALL: Final = "size 0.2: right"
RIGHT: Final = "all sizes: right"
EXACT: Final = "all sizes: first name, whether or not it can be split"
NO_MORE: Final = "nothing beside the right name is named"
PLACE: Final = "place of right names, where it can be split"
LIKE_PLACE: Final = "place of right names, or one that no record splits from it"
SIZE: Final = "true size within its 95 % interval"
FALSE_ALARMS: Final = "false alarms on none"
REJECTED: Final = "unknown rejected"
NOT_NAMED: Final = "unknown, not named (rejected, or no gap found)"
INVISIBLE: Final = "invisible said to be invisible"
BOTH: Final = "two effects: both named"
BOTH_COVERED: Final = "two effects: both named or in the set of an entry of their own"
LAW_PLACE: Final = "laws without a name: place, or one that no record splits from it"
LAW_VARIABLE: Final = "laws without a name: place and variable, or a name that closes as much"
LAW_CLOSED: Final = "laws without a name: held-out gap closed, median"
FAULTS: Final = "faults of the records: named"
FAULTS_FALSE: Final = "faults named in records without any"
FAILURES: Final = "diagnoses that ended in an error"
ECE: Final = "calibration error (ECE) of the first name"
ECE_ALL: Final = "calibration error of every name"
CLOSED_RIGHT: Final = "held-out gap closed by the right effect, median"
CLOSED_RIGHT_LARGE: Final = "- the same at size 0.5 and above"
CLOSED_RIGHT_RATE: Final = "right effects that close 80 % or more"
CLOSED_WRONG: Final = "held-out gap closed by a wrong effect in its place, median"
CLOSED_WORST: Final = "- by the best of the wrong ones of a case, median"
CLOSED_WRONG_RATE: Final = "cases in which every wrong effect closes less than 20 %"
CLOSED_MISTAKEN: Final = "held-out gap closed by wrong answers, median"
SECONDS: Final = "processor time of a diagnosis, mean [s]"
SECONDS_MOST: Final = "- longest [s]"
WITHOUT_OPEN: Final = "true candidate removed: `unknown` or a set"
WITHOUT_OPEN_LARGE: Final = "- `unknown` or a set at size 0.5 and above"
WITHOUT_NEAR: Final = (
    "- `unknown`, a set, or names there that close as much as the true one (cosine 0.98), size 0.5 and above"
)
WITHOUT_FAR: Final = "- a confident name that closes less, size 0.5 and above"
WITHOUT_MODEST: Final = "- no confident wrong name"
WITHOUT_MODEST_ALL: Final = "- no confident wrong name, cases with an identical candidate left included"
WITHOUT_UNKNOWN: Final = "- `unknown`"
WITHOUT_NONE: Final = "- `none`: no gap found"
ORACLE: Final = "found by an oracle that knows the candidate, as many false alarms allowed, size"
PERMUTED: Final = "answers permuted: right, all sizes"

ASKED: Final[Mapping[str, str]] = MappingProxyType(
    {
        RIGHT_LARGE: "at least 0.90",
        COVERED_LARGE: "at least 0.95",
        SET_SIZE: "at most 2",
        RIGHT_SMALL: "at least 0.60",
        PLACE: "at least 0.90",
        SIZE: "at least 0.90",
        FALSE_ALARMS: "at most 0.05",
        REJECTED: "at least 0.80",
        INVISIBLE: "at least 0.95",
        BOTH: "at least 0.80",
        LAW_PLACE: "at least 0.90",
        LAW_VARIABLE: "at least 0.80",
        LAW_CLOSED: "at least 0.70",
        FAULTS: "at least 0.90",
        ECE: "at most 0.05",
        CLOSED_RIGHT: "at least 0.80",
        CLOSED_WRONG: "below 0.20",
        SECONDS: "below 10 for 200 s of record",
        WITHOUT_OPEN: "at least 0.80",
        WITHOUT_NEAR: "at least 0.85",
        WITHOUT_FAR: "at most 0.05",
    }
)
"""Name of a number -> what is asked of it."""
