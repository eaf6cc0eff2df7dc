"""What may stand in a place, as reports show it."""

from __future__ import annotations

import pytest

from ident.diagnosis.search.ranked import Ranked


def ranked(probabilities: dict[str, float], *alike: str) -> Ranked:
    return Ranked(probabilities, {}, alike, {}, 0.03)


def test_a_name_that_may_be_at_either_side_is_said_to_be() -> None:
    """Of the steering of two sides, hardly more than the difference of their angles shows."""
    both = {
        "steering_offset@steering_left": 0.50,
        "steering_offset@steering_right": 0.46,
        "wheel_radius@wheel_fl": 0.01,
    }
    for place, other in (("left", "right"), ("right", "left")):
        found = ranked(both, f"steering_offset@steering_{place}").untold
        assert found == (f"steering_offset@steering_{place}", f"steering_offset@steering_{other}")


def test_a_place_that_holds_95_percent_of_its_name_is_the_only_one() -> None:
    """Whatever else has another name stands in the set of names."""
    found = ranked({"slip@wheel_rl": 0.7, "backlash@drive_rl": 0.25, "slip@chassis": 0.03}, "slip@wheel_rl").untold
    assert found == ("slip@wheel_rl",)


@pytest.mark.parametrize(("most", "named"), [(0.90, 2), (0.96, 1)])
def test_places_are_listed_until_95_percent_of_the_name_are(most: float, named: int) -> None:
    keys = [f"quadratic_drag@wheel_{corner}" for corner in ("fl", "rl", "fr")]
    found = ranked(dict(zip(keys, [most, 0.95 - most + 0.01, 0.01], strict=True)), keys[0]).untold
    assert len(found) == named


def test_what_adds_the_same_is_never_left_out() -> None:
    found = ranked({"slip@wheel_rl": 0.99}, "slip@wheel_rl", "payload@chassis").untold
    assert found == ("slip@wheel_rl", "payload@chassis")


@pytest.mark.parametrize(("unlisted", "names"), [(0.03, ("backlash",)), (0.5, ("backlash", "law"))])
def test_what_is_more_likely_none_of_the_names_than_one_in_twenty_is_a_set(
    unlisted: float, names: tuple[str, ...]
) -> None:
    key, own = "backlash@drive_rl", 1 - unlisted
    assert Ranked({key: own}, {"backlash": own}, (key,), {}, unlisted).ambiguity_set("backlash") == names
