"""What is connected in a system: every torque, and every angle as its encoder reports it."""

from __future__ import annotations

from fmu.controller.table import ControllerSource, controller_table
from fmu.interface import Experiment
from fmu.source import with_neutral
from fmu.system.structure import Connection, Structure
from fmu.table import variable_table
from ident.campaign.plan import assemble_plan
from ident.effects import Effect, make_effect
from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.description import load_vehicle
from ident.vehicle.geometry import WHEELS


def structure(*effects: Effect) -> Structure:
    vehicle = load_vehicle()
    plan = assemble_plan(vehicle, {}, steps=(Step.LANE_CHANGE,), periods=4, cycle=2e-3)
    reference = plan.reference(Step.LANE_CHANGE, vehicle.prior)
    controller = ControllerSource(vehicle, reference, Mode.STEERED, plan.designs, plan.limits, {})
    table = variable_table(vehicle, vehicle.prior, with_neutral(effects))
    return Structure("monday", "", "", table, controller_table(controller), Experiment())


def test_every_torque_and_every_angle_is_connected_once() -> None:
    found = structure().connections
    assert {one.output for one in found if one.start == "controller"} == {f"torque_{wheel}" for wheel in WHEELS}
    assert len({(one.end, one.input) for one in found}) == len(found) == 10


def test_a_drive_behind_play_is_controlled_by_the_encoder_at_its_motor() -> None:
    """As on the bus: the wheel itself nobody sees."""
    found = structure(make_effect("backlash", "drive_fl", {"gap": 0.002})).connections
    assert Connection("vehicle", "beta_fl_reported", "controller", "beta_fl") in found
    assert Connection("vehicle", "beta_rl", "controller", "beta_rl") in found
    assert Connection("vehicle", "alpha_l_reported", "controller", "alpha_l") in found


def test_inputs_of_the_vehicle_that_nobody_drives_are_no_connectors() -> None:
    """An importer that sets every input connector would set them to zero, whatever the parameters say."""
    rows = dict.fromkeys(row.name for row, _ in structure().connectors("vehicle"))
    assert "payload" not in rows
    assert "pose_x" in rows
