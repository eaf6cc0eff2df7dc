"""The master dies at full speed: time and distance to rest, against v/a and v^2/2a and against the physics."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hil.bus.clock import WallClock
from hil.bus.opening import open_bus
from hil.network import DEFAULT_NETWORK, Network
from hil.safety import DeathOfMaster, MasterDeathReport, StopSettings, evaluate
from hil.safety.emulated import let_master_die
from hil.safety.trial import TrialError
from ident.vehicle.description import load_vehicle
from quasiomni import app

FULL_SPEED = 1.5


def die(settings: StopSettings, vehicle: str = "prototype") -> MasterDeathReport:
    network = DEFAULT_NETWORK if vehicle == "prototype" else DEFAULT_NETWORK.with_name(f"{vehicle}.toml")
    return let_master_die(vehicle, network, settings)


def assert_ramp(report: MasterDeathReport, deceleration: float) -> None:
    """Uniform deceleration, written down here a second time; the frames and the simulation agree with it."""
    assert report.at_rest
    assert report.speed == pytest.approx(FULL_SPEED, rel=0.02)
    for result in (report.stopping_distance.measured, report.stopping_distance.true):
        assert result == pytest.approx(report.speed**2 / (2 * deceleration), rel=0.02)
    for result in (report.stopping_time.measured, report.stopping_time.true):
        assert result == pytest.approx(report.speed / deceleration, abs=0.025)
    assert report.detection.measured == pytest.approx(0.25, abs=0.005)
    assert report.passed


def test_the_fault_reaction_ramp_brings_842_kg_to_rest_in_time_and_distance() -> None:
    report = die(StopSettings(FULL_SPEED, abort=1, fault_reaction=2, deceleration=2.0))
    assert_ramp(report, 2.0)
    assert set(report.states.values()) == {"fault"}
    assert set(report.error_codes.values()) == {0x8130}
    assert json.loads(json.dumps(report.to_json()))["stopping_distance"]["measured"] > 0.5


def test_the_quick_stop_ramp_does_so_without_a_fault_and_stays_where_it_is_told_to() -> None:
    report = die(StopSettings(FULL_SPEED, abort=3, quick_stop=6, deceleration=1.0))
    assert_ramp(report, 1.0)
    assert set(report.states.values()) == {"quick stop active"}
    assert set(report.error_codes.values()) == {0}


def test_another_vehicle_obeys_the_same_law() -> None:
    assert_ramp(die(StopSettings(FULL_SPEED, abort=3, quick_stop=2, deceleration=1.5), "compact"), 1.5)


@pytest.mark.slow
def test_without_power_friction_alone_stops_the_vehicle() -> None:
    """Coulomb friction d_c and viscous friction d_v of four wheels against the mass: m v' = -4 (d_c + d_v v/r) / r."""
    from emulator.prototype import load_prototype

    report = die(StopSettings(FULL_SPEED, abort=2))
    prototype = load_prototype()
    truth, radius = prototype.truth, prototype.geometry.wheel_radius
    mass = truth["m_ch"] + 4 * truth["B_w"] / radius**2
    speed, way, step = report.speed, 0.0, 1e-4
    while speed > 0.0:
        speed -= step * 4 * (truth["d_cw"] + truth["d_vw"] * speed / radius) / radius / mass
        way += step * speed
    assert report.at_rest
    assert report.stopping_distance.true == pytest.approx(way, rel=0.02)
    assert report.stopping_distance.predicted is None
    assert set(report.states.values()) == {"switch on disabled"}


@pytest.mark.slow
def test_no_action_means_that_the_vehicle_drives_on_and_the_report_says_so() -> None:
    report = die(StopSettings(0.5, abort=0))
    assert not report.at_rest
    assert not report.passed


@pytest.mark.slow
def test_a_ramp_that_the_brake_chopper_cannot_take_ends_in_over_voltage_and_a_longer_way() -> None:
    report = die(StopSettings(FULL_SPEED, abort=1, fault_reaction=2, deceleration=3.7))
    assert set(report.error_codes.values()) == {0x3210}
    assert report.stopping_distance.measured > 1.5 * FULL_SPEED**2 / (2 * 3.7)
    assert not report.passed


@pytest.mark.slow
def test_the_voltage_limit_brakes_as_hard_as_the_chopper_allows_and_no_harder() -> None:
    report = die(StopSettings(FULL_SPEED, abort=1, fault_reaction=4))
    assert report.at_rest
    assert set(report.error_codes.values()) == {0x8130}
    assert report.stopping_distance.measured < FULL_SPEED**2 / (2 * 2.0)


@pytest.mark.slow
def test_a_speed_that_cannot_be_reached_is_refused() -> None:
    with pytest.raises(TrialError):
        die(StopSettings(50.0))


def test_the_command_prints_the_numbers_and_writes_them(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["safety", "--speed", "0.5", "--json", str(tmp_path / "report.json")])
    assert result.exit_code == 0, result.output
    written = json.loads((tmp_path / "report.json").read_text())
    assert written["passed"]
    assert f"{written['stopping_distance']['measured']:.3f}" in result.output


@pytest.mark.slow
def test_the_trial_runs_on_any_bus_in_real_time(tmp_path: Path, rewritten_network: Callable[..., Network]) -> None:
    """The emulator in a process of its own: nothing but frames, and the wall clock, between it and the trial."""
    # The machine that runs this may be busy with other things.
    network = rewritten_network(
        ("sample_timeout = { value = 0.1,", "sample_timeout = { value = 5.0,"),
        ("heartbeat_timeout = { value = 0.25,", "heartbeat_timeout = { value = 1.5,"),
    )
    name, settings = f"unix:{tmp_path}/can0", StopSettings(1.0, abort=3, quick_stop=2, deceleration=1.0)
    command = [sys.executable, "-m", "quasiomni", "emulate", "--bus", name]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            while "is up on" not in process.stdout.readline():
                assert process.poll() is None
            radius = load_vehicle("prototype").geometry.wheel_radius
            with open_bus(name) as bus:
                record = DeathOfMaster(bus, WallClock(), network, radius).run(settings)
        finally:
            process.terminate()
    report = evaluate(record, settings, network)
    assert report.at_rest
    assert set(report.states.values()) == {"switch on disabled"}
    assert report.detection.measured == pytest.approx(1.5, abs=0.1)
    assert report.stopping_distance.measured == pytest.approx(report.speed**2 / 2.0, rel=0.1)
    assert report.stopping_distance.true is None
