"""The sketch marks the places of the causes, all of them and no other, in the proportions of the vehicle."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise

import pytest

from ident.diagnosis.diagnosis import NamedEffect
from ident.plant.places import ALL_WHEELS, CHASSIS, DRIVES, ENCODERS, GROUPS, STEERING, WHEEL_PLACES, members
from ident.report.headline import place_words
from ident.report.sketch import USUAL, Mark, axis_sketch, mark_of, vehicle_sketch
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import PARAMETER_NAMES
from ident.vehicle.quantities import Quantity

SINGLE = (*CHASSIS, *STEERING, *ENCODERS, *WHEEL_PLACES, *DRIVES)


def marked(svg: str) -> set[str]:
    return {part.attrib["data-place"] for part in parts(svg) if part.attrib["class"] == "marked"}


def parts(svg: str) -> list[ET.Element]:
    return [group for group in ET.fromstring(svg).iter("g") if "data-place" in group.attrib]


def texts(svg: str, kind: str) -> list[ET.Element]:
    return [text for text in ET.fromstring(svg).iter("text") if text.attrib["class"] == kind]


def mark(where: str, number: int = 1) -> Mark:
    return Mark(number, where, ("stribeck", "6.00 Nm"))


@pytest.mark.parametrize("where", [*SINGLE, *GROUPS])
def test_the_place_of_a_cause_is_marked_with_all_members_and_no_other(where: str) -> None:
    svg = vehicle_sketch([mark(where)], None)
    assert marked(svg) == set(members(where))
    assert len(texts(svg, "number")) == len(members(where))
    assert [text.text for text in texts(svg, "where")] == [place_words(where)]


def test_nothing_is_marked_where_there_is_no_cause() -> None:
    svg = vehicle_sketch([], None)
    assert not marked(svg)
    assert not texts(svg, "number")
    assert {part.attrib["data-place"] for part in parts(svg)} == set(SINGLE)


@pytest.mark.parametrize("name", PARAMETER_NAMES)
def test_a_changed_parameter_is_where_it_belongs(name: str) -> None:
    places = marked(vehicle_sketch([mark(name)], None))
    sides = {"l": {STEERING[0]}, "r": {STEERING[1]}, "h": set(CHASSIS), "w": set(members(ALL_WHEELS[0]))}
    assert places == sides[name[-1]]


def _centre(svg: str, place: str) -> tuple[float, float]:
    box = next(part.find("rect") for part in parts(svg) if part.attrib["data-place"] == place)
    assert box is not None
    x, y, width, height = (float(box.attrib[name]) for name in ("x", "y", "width", "height"))
    return x + width / 2, y + height / 2


def test_wheels_stand_where_they_do_on_the_vehicle(prototype: VehicleDescription) -> None:
    """Front upwards, left to the left, in the proportions of wheelbase, track and offset."""
    for geometry in (prototype.geometry, replace(prototype.geometry, wheelbase=0.9, track_width=1.0), None):
        shape = geometry or USUAL
        svg = vehicle_sketch([], geometry)
        left, front = _centre(svg, "wheel_fl")
        right, rear = _centre(svg, "wheel_rr")
        assert left < 0 < right
        assert front < 0 < rear
        expected = (shape.track_width + 2 * shape.wheel_offset) / shape.wheelbase
        assert (right - left) / (rear - front) == pytest.approx(expected, abs=0.01)


def test_words_of_several_causes_stand_below_each_other_and_inside_the_drawing() -> None:
    where = ("wheel_fl", "drive_fl", "steering_left", "encoder_left", "steering_left", "drives")
    svg = vehicle_sketch([mark(one, number) for number, one in enumerate(where, 1)], None)
    heights = sorted(float(text.attrib["y"]) for text in texts(svg, "where"))
    assert len(heights) == len(where)
    assert min(b - a for a, b in pairwise(heights)) > 30
    _, top, _, height = (float(value) for value in ET.fromstring(svg).attrib["viewBox"].split())
    assert top < heights[0]
    assert heights[-1] + 30 < top + height


def test_an_axis_is_marked_among_the_axes() -> None:
    svg = axis_sketch([mark("axis_2<1")], ["axis_1", "axis_2", "axis_3"])
    assert marked(svg) == {"axis_2"}
    assert marked(axis_sketch([mark("axis")], ["axis"])) == {"axis"}


def test_a_cause_is_said_with_its_size() -> None:
    quantities = {"amplitude": Quantity(6.0, "Nm", "", 0.1), "velocity": Quantity(0.3, "rad/s", "", 0.01)}
    effect = NamedEffect("stribeck", "steering_left", quantities, 0.9, ("stribeck",), 1.0)
    assert mark_of(1, effect).words == ("stribeck", "6.00 Nm")
    share = replace(effect, name="torque_gain", parameters={"error": Quantity(0.03, "1", "", 0.001)})
    assert mark_of(1, share).words == ("torque gain", "0.0300")
