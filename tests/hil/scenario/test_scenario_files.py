"""What a scenario file says, and what is said of one that says nothing, or what cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.scenario.reader import read_scenario
from hil.scenario.scenario import Begin, Scenario, Span, Torques, torques_at
from ident.errors import DataFileError

EXPECTS = '[[expect]]\nthat = "at_rest"\n'


def read(tmp_path: Path, text: str) -> Scenario:
    path = tmp_path / "day.scenario.toml"
    path.write_text(text)
    return read_scenario(path)


def test_a_file_is_read_with_its_times_defaults_and_words(tmp_path: Path) -> None:
    scenario = read(
        tmp_path,
        """
        [scenario]
        begin = "start"
        stand = "jack"
        prototype = "compact"

        [[setpoint]]
        at = 2.0
        torque = [0.1, 0.2, 0.3, 0.4]
        over = 0.5

        [[setpoint]]
        at = 1.0
        torque = 0.5

        [[setpoint]]
        at = 0.5
        node = "drive_fl"
        object = 0x6072
        value = 500

        [[fault]]
        at = 1.5
        inject = "power@drive_rr:from=1s,to=2s"

        [[expect]]
        at = 1.5
        that = "emergency"
        node = "drive_rr"
        within = 3.0
        """,
    )
    assert (scenario.name, scenario.begin, scenario.lifted, scenario.drives) == ("day", Begin.START, True, True)
    assert [one.at for one in scenario.torques] == [1.0, 2.0]
    assert scenario.torques[0].torques == (0.5, 0.5, 0.5, 0.5)
    assert str(scenario.writings[0]) == "drive_fl 6072h:0 = 500"
    assert (scenario.faults[0].start, scenario.faults[0].end) == (2.5, 3.5)
    assert scenario.expected[0].span is Span.WITHIN
    assert scenario.duration == 4.5
    assert scenario.settings == {"prototype": "compact"}


MISTAKES = {
    "no TOML": ("[[expect", "is not valid TOML"),
    "a table that is none": (f"{EXPECTS}[[faults]]\ninject = 'death'\n", "faults is not known"),
    "a misspelt key": (f"{EXPECTS}[[setpoint]]\nat = 1\ntorques = 1\n", "setpoint[1] sets nothing"),
    "a key of another set-point": (
        f"{EXPECTS}[[setpoint]]\nat = 1\ntorque = 1\nnode = 'drive_fl'\n",
        "setpoint[1].node",
    ),
    "no time": (f"{EXPECTS}[[setpoint]]\ntorque = 1\n", "setpoint[1] has no at"),
    "a time before the beginning": (f"{EXPECTS}[[setpoint]]\nat = -1\ntorque = 1\n", "setpoint[1].at = -1"),
    "three torques": (f"{EXPECTS}[[setpoint]]\nat = 1\ntorque = [1, 2, 3]\n", "setpoint[1].torque"),
    "a torque that is a word": (f"{EXPECTS}[[setpoint]]\nat = 1\ntorque = [1, 2, 3, 'x']\n", "setpoint[1].torque[4]"),
    "a node that is none": (
        f"{EXPECTS}[[setpoint]]\nat = 1\nnode = 'drive_xx'\nobject = 0x6072\nvalue = 1\n",
        "drive_xx",
    ),
    "a fault that is none": (f"{EXPECTS}[[fault]]\ninject = 'vanish@0x1'\n", "fault[1].inject: There is no fault"),
    "a condition that is none": ("[[expect]]\nthat = 'atrest'\n", "expect[1].that = 'atrest'"),
    "a condition without its node": ("[[expect]]\nthat = 'emergency'\n", "expect[1] has no node"),
    "a state that is none": ("[[expect]]\nthat = 'all_drives'\nstate = 'on'\n", "expect[1].state = 'on'"),
    "a key of another condition": ("[[expect]]\nthat = 'at_rest'\ncode = 1\n", "expect[1].code is not known"),
    "two spans": ("[[expect]]\nthat = 'at_rest'\nwithin = 1\nthroughout = 1\n", "within and throughout"),
    "a value without bounds": ("[[expect]]\nthat = 'value'\nnode = 'drive_fl'\nobject = 0x6077\n", "no bounds"),
    "data that are none": ("[[expect]]\nthat = 'frame'\nid = 0x181\ndata = 'xy'\n", "'xy' is no data"),
    "no expectations": ("[scenario]\nname = 'nothing'\n", "expects nothing"),
    "an end before the end": (
        "[scenario]\nduration = 1\n[[expect]]\nthat = 'at_rest'\nat = 2\n",
        "scenario.duration = 1",
    ),
    "an identifier of 29 bits": ("[[expect]]\nthat = 'frame'\nid = 0x12345\n", "expect[1].id"),
    "a truth for a number": ("[[expect]]\nthat = 'at_rest'\nat = true\n", "expect[1].at = True"),
}


@pytest.mark.parametrize(("text", "said"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_said_with_file_key_and_remedy(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DataFileError) as caught:
        read(tmp_path, text)
    assert "day.scenario.toml" in caught.value.what
    assert said in caught.value.what
    assert caught.value.remedy


steps = st.lists(
    st.tuples(st.floats(0.0, 10.0), st.tuples(*[st.floats(-3.0, 3.0)] * 4), st.sampled_from([0.0, 0.1, 0.5, 2.0])),
    max_size=6,
)


@given(steps=steps, time=st.floats(0.0, 12.0))
def test_a_ramp_begins_where_the_one_before_it_has_come_to(
    steps: list[tuple[float, tuple[float, float, float, float], float]], time: float
) -> None:
    """Against the same ramps, followed by small steps of time from the beginning on."""
    ordered = [Torques(*step) for step in sorted(steps, key=lambda step: step[0])]
    value, instant = np.zeros(4), 0.0
    corners = sorted({time, *(c for one in ordered for c in (one.at, one.at + one.over) if c < time)})
    active, start, since = None, np.zeros(4), 0.0
    for corner in corners:
        instant = corner
        value = _on_ramp(active, start, since, instant, value)
        for one in ordered:
            if one.at == instant:
                active, start, since = one, value, instant
                value = _on_ramp(active, start, since, instant, value)
    np.testing.assert_allclose(torques_at(ordered, time), value, atol=1e-9)


def _on_ramp(active: Torques | None, start: np.ndarray, since: float, instant: float, value: np.ndarray) -> np.ndarray:
    if active is None:
        return value
    if active.over == 0.0 or instant >= since + active.over:
        return np.array(active.torques)
    return start + (instant - since) / active.over * (np.array(active.torques) - start)
