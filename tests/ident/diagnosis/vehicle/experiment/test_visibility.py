"""What an experiment can show: identities that hold on paper, and the page that says so."""

from __future__ import annotations

from pathlib import Path

from ident.diagnosis.vehicle.experiment.visibility import Visibility
from ident.diagnosis.vehicle.experiment.visibility_table import table_text, visibility_table
from ident.vehicle.description import VehicleDescription

PAGE = Path(__file__).parents[5] / "docs" / "visibility.md"


def test_the_four_steps_hide_what_their_equations_do_not_hold(prototype: VehicleDescription) -> None:
    sights = Visibility(prototype)["four steps"]
    hidden = {key.partition("@")[0] for key, sight in sights.items() if not sight.visible}
    # Gain of a torque scales a parameter; nothing turns and travels at once; a payload is mass like any other.
    assert hidden == {"torque_gain", "com_offset", "steering_unit_mass", "payload"}


def test_a_bias_is_asymmetric_friction_of_its_wheel(prototype: VehicleDescription) -> None:
    sights = Visibility(prototype)["four steps"]
    for wheel in ("fl", "rl", "fr", "rr"):
        assert f"asymmetric_coulomb@wheel_{wheel}" in sights[f"torque_bias@drive_{wheel}"].alike


def test_a_slope_is_asymmetric_friction_of_all_wheels_until_the_vehicle_turns(prototype: VehicleDescription) -> None:
    assert "asymmetric_coulomb@wheels" in Visibility(prototype)["four steps"]["slope@chassis"].alike
    assert not Visibility(prototype)["two headings"]["slope@chassis"].alike


def test_front_and_rear_of_a_side_are_told_apart_in_the_air_alone(prototype: VehicleDescription) -> None:
    assert "quadratic_drag@wheel_rl" in Visibility(prototype)["four steps"]["quadratic_drag@wheel_fl"].alike
    assert "quadratic_drag@wheel_rl" not in Visibility(prototype)["wheels lifted"]["quadratic_drag@wheel_fl"].alike


def test_dither_shows_the_gain_of_every_drive(prototype: VehicleDescription) -> None:
    sights = Visibility(prototype)["torque dither"]
    assert all(sights[f"torque_gain@drive_{wheel}"].visible for wheel in ("fl", "rl", "fr", "rr"))


def test_a_known_load_shows_the_gain_of_a_drive(prototype: VehicleDescription) -> None:
    """Otherwise every parameter is larger by as much."""
    assert not Visibility(prototype)["four steps"]["torque_gain@drive_fl"].visible
    assert Visibility(prototype)["known payload"]["torque_gain@drive_fl"].visible


def test_the_centre_of_mass_shows_where_weight_pulls_while_the_vehicle_turns(prototype: VehicleDescription) -> None:
    assert Visibility(prototype)["on a slope"]["com_offset@chassis"].visible


def test_the_page_is_what_the_equations_say_of_the_prototype() -> None:
    assert PAGE.read_text(encoding="utf-8") == table_text(visibility_table())
