"""A fault is a line of text, and a line of text is a fault."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.faults import Fault, FaultKind, parse_fault, parse_script
from hil.faults.fault import SPECIFICATIONS, FaultError


def numbers_of(kind: FaultKind) -> st.SearchStrategy[dict[str, float]]:
    known = SPECIFICATIONS[kind].parameters
    each = {
        name: st.floats(one.low, min(one.high, 1e6), allow_nan=False, allow_infinity=False)
        for name, one in known.items()
    }
    return st.fixed_dictionaries({}, optional=each)


@st.composite
def any_fault(draw: st.DrawFn) -> Fault:
    kind = draw(st.sampled_from(FaultKind))
    start = draw(st.floats(0.0, 1e4))
    end = draw(st.one_of(st.just(math.inf), st.floats(start, 2e4)))
    place = draw(st.sampled_from(["0x181", "0x180-0x1ff", "all", "drive_fl", "master", "floor"]))
    return Fault(kind, place, start, end, draw(numbers_of(kind)))


@given(fault=any_fault())
def test_what_a_fault_says_of_itself_reads_back_as_the_same_fault(fault: Fault) -> None:
    assert parse_fault(str(fault)) == fault


EXAMPLES = {
    "drop@0x181:rate=10%,from=2s,to=3s": Fault(FaultKind.DROP, "0x181", 2.0, 3.0, {"rate": 0.1}),
    "delay@drive_fl: time = 2ms , jitter=500us": Fault(
        FaultKind.DELAY, "drive_fl", parameters={"time": 0.002, "jitter": 0.0005}
    ),
    "babble@0x001:rate=200/s": Fault(FaultKind.BABBLE, "0x001", parameters={"rate": 200.0}),
    "trip@drive_rr:code=0x3210": Fault(FaultKind.TRIP, "drive_rr", parameters={"code": 0x3210}),
    "death:from=1.5": Fault(FaultKind.DEATH, "master", 1.5),
    "friction:value=0.05": Fault(FaultKind.FRICTION, "floor", parameters={"value": 0.05}),
}


@pytest.mark.parametrize(("text", "fault"), EXAMPLES.items(), ids=EXAMPLES)
def test_numbers_carry_units(text: str, fault: Fault) -> None:
    read = parse_fault(text)
    assert (read.kind, read.place, read.start, read.end) == (fault.kind, fault.place, fault.start, fault.end)
    assert read.parameters == pytest.approx(dict(fault.parameters))


REFUSED = {
    "vanish@0x181": "vanish",
    "drop": "where",
    "drop@0x181:rate": "rate",
    "drop@0x181:rate=much": "much",
    "drop@0x181:rate=nan": "nan",
    "drop@0x181:rate=110%": "out of range",
    "drop@0x181:copies=2": "copies",
    "drop@0x181:from=3s,to=2s": "from 3 s",
    "drop@0x181:from=-1s": "from -1 s",
}


@pytest.mark.parametrize(("text", "named"), REFUSED.items(), ids=REFUSED)
def test_what_is_no_fault_is_named_with_a_remedy(text: str, named: str) -> None:
    with pytest.raises(FaultError) as caught:
        parse_fault(text)
    assert named in caught.value.what
    assert caught.value.remedy


def test_a_script_holds_one_fault_a_line_and_comments() -> None:
    script = "# a bad day\n\ndrop@0x181:from=1s  # the first drive\n  death:from=2s\n"
    assert [fault.kind for fault in parse_script(script)] == [FaultKind.DROP, FaultKind.DEATH]


def test_the_line_of_a_script_that_is_wrong_is_named() -> None:
    with pytest.raises(FaultError, match="Line 3"):
        parse_script("death\n# fine\ndorp@0x181")


def test_the_documentation_lists_every_fault_with_its_numbers() -> None:
    text = (Path(__file__).parents[3] / "docs" / "bench.md").read_text(encoding="utf-8")
    rows = {line.split("`")[1]: line for line in text.splitlines() if line.startswith("| `")}
    for kind, one in SPECIFICATIONS.items():
        assert all(f"`{name}`" in rows[kind] for name in one.parameters), kind
