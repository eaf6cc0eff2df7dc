"""The trace of CiA's conformance tool, replayed against an emulated drive."""

from __future__ import annotations

import ast
import os
from pathlib import Path

import can
import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.conformance.cases import NOT_APPLICABLE, OWN_TESTS, STAND_INS
from hil.conformance.emulated import replay_trace
from hil.conformance.replay import NODE_ID, Replay
from hil.conformance.report import Verdict, write_page
from hil.conformance.trace import Case, TracedFrame, Way, read_trace
from ident.errors import DataFileError

ROOT = Path(__file__).parents[3]
TRACE = os.environ.get("QUASIOMNI_CIA_TRACE", "")

needs_trace = pytest.mark.skipif(not TRACE, reason="QUASIOMNI_CIA_TRACE does not name the trace")


@pytest.fixture(scope="module")
def verdicts() -> list[Verdict]:
    return replay_trace(Path(TRACE))


@needs_trace
def test_all_cases_of_the_tool_are_accounted_for(verdicts: list[Verdict]) -> None:
    assert len(verdicts) == 127
    elsewhere = {*OWN_TESTS, *NOT_APPLICABLE}
    assert {verdict.case.number for verdict in verdicts} >= elsewhere
    assert [verdict.case.number for verdict in verdicts if verdict.outcome is None] == [
        verdict.case.number for verdict in verdicts if verdict.case.number in elsewhere
    ]


@needs_trace
def test_every_replayed_case_passes(verdicts: list[Verdict]) -> None:
    replayed = [verdict for verdict in verdicts if verdict.outcome is not None]
    assert len(replayed) > 80
    assert [str(verdict) for verdict in replayed if not verdict.passed] == []


@needs_trace
def test_what_the_tool_found_wrong_with_its_device_is_not_taken_for_right(verdicts: list[Verdict]) -> None:
    assert not [verdict.case.number for verdict in verdicts if verdict.passed and verdict.case.verdict == "failed"]


@needs_trace
def test_the_page_in_the_documentation_is_this_one(verdicts: list[Verdict]) -> None:
    """Written by `quasiomni conformance TRACE --out docs/conformance.md`."""
    assert (ROOT / "docs" / "conformance.md").read_text(encoding="utf-8") == write_page(verdicts)


@pytest.mark.parametrize("name", sorted(set(OWN_TESTS.values())))
def test_the_tests_that_stand_in_for_cases_exist(name: str) -> None:
    path, _, function = name.partition("::")
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def tool(can_id: int, data: str) -> TracedFrame:
    return TracedFrame(can_id, Way.TO_NODE, False, bytes.fromhex(data))


def device(can_id: int, data: str) -> TracedFrame:
    return TracedFrame(can_id, Way.FROM_NODE, False, bytes.fromhex(data))


def case(*frames: TracedFrame) -> Case:
    return Case("0.1", "made up", "", "passed", (), frames, frozenset())


READ_COB_ID = tool(0x604, "4005100000000000")

WRONG_ANSWERS = {
    "another value": (READ_COB_ID, device(0x584, "4305100081000000")),
    "an abort where data should come": (READ_COB_ID, device(0x584, "8005100000000206")),
    "another object": (READ_COB_ID, device(0x584, "4306100000000000")),
    "data where an abort should come": (tool(0x604, "4000100000000000"), device(0x584, "8000100011000906")),
    "another abort code": (tool(0x604, "4000100100000000"), device(0x584, "8000100100000206")),
    "no acknowledgement": (tool(0x604, "2b17100000000000"), device(0x584, "8017100000000206")),
    "another toggle bit": (
        tool(0x604, "4008100000000000"),
        device(0x584, "4108100010000000"),
        tool(0x604, "6000000000000000"),
        device(0x584, "1043414e6f70656e"),
    ),
    "no boot-up": (device(0x704, "00"),),
    "another state": (
        tool(0x604, "2b171000e8030000"),
        device(0x584, "6017100000000000"),
        device(0x704, "05"),
    ),
    "no emergency": (device(0x084, "1082000402000000"),),
    "an answer that does not come": (tool(0x603, "4000100000000000"), device(0x584, "4300100092010200")),
}


@pytest.mark.parametrize("frames", WRONG_ANSWERS.values(), ids=WRONG_ANSWERS)
def test_a_replay_notices(frames: tuple[TracedFrame, ...]) -> None:
    with LockstepBench(Flywheels()) as bench:
        objects = {(i, k) for i, k, _ in bench.devices.nodes[NODE_ID].object_dictionary.entries()}
        replay = Replay(bench.bus, bench.clock, objects, STAND_INS)
        replay.run(case(tool(0x000, "8104"), device(0x704, "00")))
        assert not replay.run(case(*frames)).passed


def test_a_node_that_is_not_there_fails_every_case() -> None:
    with LockstepBench(Flywheels()) as bench:
        bench.devices.power_off(NODE_ID)
        replay = Replay(bench.bus, bench.clock, set(), STAND_INS)
        outcome = replay.run(case(READ_COB_ID, device(0x584, "4305100080000000")))
    assert outcome.deviations[0].got is None
    assert "got nothing" in str(outcome.deviations[0])


def test_a_case_is_read_from_its_lines(tmp_path: Path) -> None:
    path = tmp_path / "trace.md"
    path.write_text(
        "General\t: ### Prepare DUT for test ####\n"
        "Test CAN\t: CAN1  000 Tx SD  2  81 04\n"
        "Test Info\t: ### Test case : 2.5  -  Test name : SDO 05 ####\n"
        "Test Info\t: Try to read non-existing sub-index 1000h:01h.\n"
        "Test CAN\t: CAN1  7FF Tx SD  6  01 02 05 00 00 00\n"
        "Test Notice\t: SDO 05: Valid abort codes are 06090011h or 08000000h\n"
        "Test CAN\t: CAN1  604 Tx SD  8  40 00 10 01 00 00 00 00\n"
        "Test CAN\t: CAN1  584 Rx SD  8  80 00 10 01 11 00 09 06\n"
        "Test Info\t: SDO 05: Passed\n"
    )
    (found,) = read_trace(path)
    assert (found.number, found.name, found.verdict) == ("2.5", "SDO 05", "passed")
    assert found.purpose == "Try to read non-existing sub-index 1000h:01h."
    assert found.abort_codes == {0x06090011, 0x08000000}
    assert found.preparation == (tool(0x000, "8104"),)
    assert found.frames == (tool(0x604, "4000100100000000"), device(0x584, "8000100111000906"))


@pytest.mark.parametrize("text", [None, "", "a report about something else\n"])
def test_a_file_that_is_no_trace_is_named(tmp_path: Path, text: str | None) -> None:
    path = tmp_path / "trace.md"
    if text is not None:
        path.write_text(text)
    with pytest.raises(DataFileError, match=r"trace\.md"):
        read_trace(path)


def test_the_bus_of_a_replay_is_any_python_can_bus() -> None:
    assert issubclass(type(LockstepBench(Flywheels()).bus), can.BusABC)
