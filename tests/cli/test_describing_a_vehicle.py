"""A new user's first commands: `init`, `check`, and what `identify` makes of the vehicle file that is named."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hil.bench.prototypes import load_emulated
from hil.campaign.folder import RunFolder
from hil.network import network_file_of
from hil.network.described import load_described
from ident.estimate.result import KnownInertia
from ident.records.record import Step
from ident.vehicle.description import find_data_file, load_vehicle
from ident.vehicle.parameters import PARAMETER_NAMES

Quasi = Callable[..., Any]

MEASURES = {
    "--wheelbase": 1.6,
    "--track-width": 1.0,
    "--wheel-offset": 0.10,
    "--wheel-radius": 0.15,
    "--gear-ratio": 25.0,
    "--mass": 1500.0,
    "--rated-torque": 1.27,
}
SUFFIXES = (".toml", ".network.toml", ".drive.eds", ".encoder.eds")


def words(measures: dict[str, float]) -> list[str]:
    return [str(word) for item in measures.items() for word in item]


@pytest.fixture
def vehicle(quasi: Quasi, tmp_path: Path) -> Path:
    """The vehicle file of a new user, with what lies beside it."""
    path = tmp_path / "my_vehicle.toml"
    assert quasi("init", path, *words(MEASURES)).code == 0
    return path


def replaced(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_what_is_measured_stands_in_the_files_and_they_fit(vehicle: Path) -> None:
    described = load_described(vehicle, network_file_of(str(vehicle)))
    geometry = described.vehicle.geometry
    assert (geometry.wheelbase, geometry.track_width, geometry.wheel_offset) == (1.6, 1.0, 0.10)
    assert (geometry.wheel_radius, geometry.gear_ratio) == (0.15, 25.0)
    assert described.vehicle.prior["m_ch"] == 1500.0
    assert described.vehicle.limits.rated_torque == 1.27
    assert described.network.path == vehicle.with_name("my_vehicle.network.toml")
    assert all(node.quantity("gear_ratio") == 25.0 for node in described.network.drives)
    assert {path.name for path in vehicle.parent.iterdir()} == {f"my_vehicle{suffix}" for suffix in SUFFIXES}


def test_priors_that_are_guessed_say_how_roughly(vehicle: Path) -> None:
    prior = load_vehicle(vehicle).prior
    for name in PARAMETER_NAMES:
        assert 0.05 * prior[name] < prior.std_of(name) < prior[name]


def test_the_emulated_vehicle_has_the_priors_as_its_truth_and_says_what_is_assumed(vehicle: Path) -> None:
    emulated = load_emulated(vehicle, network_file_of(str(vehicle)))
    prior = load_vehicle(vehicle).prior
    assert [emulated.prototype.truth[name] for name in PARAMETER_NAMES] == [prior[name] for name in PARAMETER_NAMES]
    assert len(emulated.assumed) > 10
    assert all("assumed" in line for line in emulated.assumed)


@pytest.mark.parametrize("option", MEASURES)
def test_what_is_not_given_is_asked_for_by_the_name_of_its_option(quasi: Quasi, tmp_path: Path, option: str) -> None:
    rest = {name: value for name, value in MEASURES.items() if name != option}
    answer = quasi("init", tmp_path / "mine.toml", *words(rest))
    assert answer.code == 2
    assert option in answer.error
    assert not list(tmp_path.iterdir())


class Terminal(io.StringIO):
    """A person who types."""

    def isatty(self) -> bool:
        return True


def test_a_person_at_a_terminal_is_asked_for_what_is_not_given(
    quasi: Quasi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = {name: MEASURES[name] for name in ("--wheelbase", "--mass")}
    rest = [str(value) for name, value in MEASURES.items() if name not in given]
    monkeypatch.setattr(sys, "stdin", Terminal("\n".join(rest) + "\n"))
    answer = quasi("init", tmp_path / "mine.toml", *words(given))
    assert answer.code == 0, answer
    for asked in ("track_width", "wheel_offset", "wheel_radius", "gear_ratio", "rated_torque"):
        assert asked in answer.out
    assert load_vehicle(tmp_path / "mine.toml").geometry.track_width == 1.0


IMPOSSIBLE = {
    "a wheelbase in mm": ({"--wheelbase": 1600}, "--wheelbase"),
    "a negative mass": ({"--mass": -1500}, "--mass"),
    "no number": ({"--mass": "nan"}, "mass"),
    "motors that cannot move it": ({"--mass": 4900, "--rated-torque": 0.3}, "friction"),
    "motors that are much too large": ({"--rated-torque": 40, "--mass": 300}, "too large"),
    "a gear that makes it crawl": ({"--gear-ratio": 99}, "too much"),
    "wheels that overlap": (
        {"--wheelbase": 0.5, "--wheel-radius": 0.3, "--wheel-offset": 0.3, "--track-width": 2, "--mass": 800},
        "overlap",
    ),
    "an offset that is no lever": ({"--wheel-offset": 0.02}, "wheel_offset over wheel_radius"),
}


@pytest.mark.parametrize(("changed", "named"), IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_a_vehicle_that_cannot_be_is_not_described(
    quasi: Quasi, tmp_path: Path, changed: dict[str, float], named: str
) -> None:
    answer = quasi("init", tmp_path / "mine.toml", *words(MEASURES | changed))
    assert answer.code == 2
    assert named in answer.error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_nothing_is_overwritten_and_nothing_is_half_written(quasi: Quasi, tmp_path: Path, suffix: str) -> None:
    precious = tmp_path / f"mine{suffix}"
    precious.write_text("precious")
    answer = quasi("init", tmp_path / "mine.toml", *words(MEASURES))
    assert answer.code == 2
    assert str(precious) in answer.err.replace("\n", "")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["precious"]


@pytest.mark.parametrize("name", ["mine.txt", "mine", "a[b].toml", "my vehicle.toml"])
def test_a_name_that_no_vehicle_can_have(quasi: Quasi, tmp_path: Path, name: str) -> None:
    assert quasi("init", tmp_path / name, *words(MEASURES)).code == 2
    assert not list(tmp_path.iterdir())


def test_what_was_written_fits_and_shows_what_is_assumed(quasi: Quasi, vehicle: Path) -> None:
    answer = quasi("check", vehicle)
    assert answer.code == 0
    assert "They fit." in answer.out
    for assumed in ("motor_speed", "C_ch", "wheel_mass"):
        assert assumed in answer.out
    found = json.loads(quasi("check", vehicle, "--json").out)
    assert found["verdict"] == "fits"
    assert {finding["severity"] for finding in found["findings"]} == {"assumed"}
    assert all(finding.keys() == {"severity", "code", "where", "text", "remedy"} for finding in found["findings"])


WRONG = {
    "a gear that stands twice": (
        ".network.toml",
        "[devices.wheel_drive.quantities]\n",
        'gear_ratio = { value = 20.0, unit = "1", source = "x" }\n',
        1,
    ),
    "increments": (
        ".network.toml",
        "counts_per_revolution = { value = 1048576",
        "counts_per_revolution = { value = 8192",
        1,
    ),
    "an identity": (".network.toml", "product_code = 0x402", "product_code = 0x403", 1),
    "a torque": (".toml", "rated_torque = { value = 1.27", "rated_torque = { value = 1.72", 1),
    "an EDS of another motor": (".drive.eds", "DefaultValue=1270", "DefaultValue=2390", 1),
    "an encoder of another range": (".encoder.eds", "DefaultValue=131072", "DefaultValue=65536", 1),
    "a yaw inertia in kg cm^2": (".toml", "C_ch = { value = 811.0", "C_ch = { value = 8110000.0", 0),
    "a speed that the drive does not allow": (
        ".toml",
        "motor_speed = { value = 314.0",
        "motor_speed = { value = 628.0",
        0,
    ),
    "a key": (".toml", "wheelbase =", "whelbase =", 2),
    "a syntax": (".network.toml", "[bus]", "[bus", 2),
    "no EDS": (".network.toml", 'eds = "my_vehicle.drive.eds"', 'eds = "nowhere.eds"', 2),
}


@pytest.mark.parametrize(("suffix", "old", "new", "code"), WRONG.values(), ids=WRONG)
def test_a_wrong_number_is_found(quasi: Quasi, vehicle: Path, suffix: str, old: str, new: str, code: int) -> None:
    replaced(vehicle.with_suffix(suffix), old, f"{old}{new}" if old.startswith("[devices") else new)
    answer = quasi("check", vehicle, "--json")
    found = json.loads(answer.out)
    assert answer.code == code
    assert {1: "error", 2: "unreadable", 0: "warning"}[code] in {one["severity"] for one in found["findings"]}
    if code:
        assert quasi("campaign", "--vehicle", vehicle, "--out", vehicle.with_name("run")).code == 2


@pytest.fixture(scope="module")
def run(drive: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run of the prototype."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    drive(folder, [Step.STEERING_LEFT, Step.ROTATION], known_inertia=KnownInertia(0.121, 0.001, "given"))
    return folder


def own(tmp_path: Path, *changes: tuple[str, str]) -> Path:
    """The prototype's vehicle file with numbers changed."""
    path = tmp_path / "mine.toml"
    shutil.copy(find_data_file("ident.vehicle", "prototype"), path)
    for old, new in changes:
        replaced(path, old, new)
    return path


@pytest.mark.parametrize("command", ["identify", "diagnose", "cosim"])
def test_a_vehicle_file_beside_a_run_is_obeyed_or_refused(
    quasi: Quasi, run: Path, tmp_path: Path, command: str
) -> None:
    before = ("x.fmu", "--record") if command == "cosim" else ()
    nowhere = quasi(command, *before, run, "--vehicle", tmp_path / "nowhere.toml")
    assert nowhere.code == 2
    assert "nowhere.toml does not exist" in nowhere.error
    broken = tmp_path / "broken.toml"
    broken.write_text("[geometry")
    assert "not valid TOML" in quasi(command, *before, run, "--vehicle", broken).error
    other = quasi(
        command, *before, run, "--vehicle", own(tmp_path, ("gear_ratio = { value = 20", "gear_ratio = { value = 25"))
    )
    assert other.code == 2
    assert "mine.toml: [geometry] gear_ratio = 25" in other.error
    assert "network.toml: [devices.wheel_drive.quantities] gear_ratio = 20" in other.error


def test_a_vehicle_file_with_other_lengths_is_taken_and_that_is_said(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    other = own(tmp_path, ("wheelbase = { value = 1.2", "wheelbase = { value = 1.205"))
    answer = quasi("identify", run, "--vehicle", other, "--out", tmp_path)
    assert "geometry.wheelbase 1.2 -> 1.205 m" in " ".join(answer.out.split())


def test_a_run_is_checked_by_its_own_files_and_against_others(quasi: Quasi, run: Path, tmp_path: Path) -> None:
    assert quasi("check", run).code == 0
    answer = quasi("check", run, own(tmp_path, ("wheelbase = { value = 1.2", "wheelbase = { value = 1.3")), "--json")
    assert answer.code == 1
    codes = {finding["code"] for finding in json.loads(answer.out)["findings"]}
    assert {"other_vehicle", "wrong_posture"} <= codes


def test_a_gear_that_contradicts_the_network_of_a_run_is_a_finding_and_no_unreadable_file(
    quasi: Quasi, run: Path, tmp_path: Path
) -> None:
    answer = quasi("check", run, own(tmp_path, ("gear_ratio = { value = 20", "gear_ratio = { value = 25")), "--json")
    found = json.loads(answer.out)
    assert answer.code == 1
    assert found["verdict"] == "does_not_fit"
    assert {"disagreement", "other_vehicle"} <= {finding["code"] for finding in found["findings"]}


LENGTHS = {
    "wheelbase": ("wheelbase = { value = 1.2", "wheelbase = { value = 1.26", "wrong_posture"),
    "track width": ("track_width = { value = 0.8", "track_width = { value = 0.85", "wrong_posture"),
    "wheel offset": ("wheel_offset = { value = 0.12", "wheel_offset = { value = 0.123", "lever"),
    "wheel radius": ("wheel_radius = { value = 0.10", "wheel_radius = { value = 0.102", "lever"),
    "steering stop": ("steering_limit = { value = 1.62", "steering_limit = { value = 1.0", "beyond_stops"),
    "motor speed": ("motor_speed = { value = 314.0", "motor_speed = { value = 20.0", "beyond_motor_speed"),
}


@pytest.mark.parametrize(("old", "new", "code"), LENGTHS.values(), ids=LENGTHS)
def test_frames_show_lengths_that_are_wrong(
    quasi: Quasi, run: Path, tmp_path: Path, old: str, new: str, code: str
) -> None:
    answer = quasi("check", own(tmp_path, (old, new)), RunFolder(run).frames, "--json")
    assert code in {finding["code"] for finding in json.loads(answer.out)["findings"]}, answer.out
    assert answer.code in (1, 2)


def test_an_own_network_without_the_gear_takes_that_of_the_vehicle(quasi: Quasi, vehicle: Path) -> None:
    network = vehicle.with_suffix(".network.toml")
    assert not re.search(r"(?m)^rated_torque", network.read_text())
    answer = quasi("dbc", "--out", vehicle.with_name("x.dbc"), "--network", network)
    assert answer.code == 2
    assert "--vehicle" in answer.error
    assert quasi("dbc", "--out", vehicle.with_name("x.dbc"), "--network", network, "--vehicle", vehicle).code == 0
