"""The plugin in a user's project: what passes, what fails and how, and what a failure leaves behind."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import can
import pytest

# Each run in this process forgets what it has loaded; what is heavy and loaded here stays.
import hil.master
import hil.pytest_plugin.recording
import hil.testing  # noqa: F401

pytest_plugins = ["pytester"]


@pytest.fixture
def project(pytester: pytest.Pytester) -> pytest.Pytester:
    """A project whose tests have a master at hand; in this process, with the plugin as pytest loads it."""
    pytester.makeini("[pytest]\naddopts = -p no:cacheprovider\n")
    pytester.makeconftest(
        """
        import pytest
        from hil.master import Master

        @pytest.fixture
        def master(bench):
            with Master(bench.bus, bench.clock, bench.network) as master:
                master.boot()
                master.enable()
                bench.every_cycle(lambda: master.exchange((0.0,) * 4))
                yield master
        """
    )
    return pytester


def properties(path: Path) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for entry in ElementTree.parse(path).iter("property"):
        found.setdefault(entry.attrib["name"], []).append(entry.attrib["value"])
    return found


def test_a_test_that_holds_leaves_nothing_but_numbers_in_the_junit_file(project: pytest.Pytester) -> None:
    project.makepyfile(
        """
        from hil.testing import all_drives, at_rest

        def test_rest(master, expect, bus, clock, vehicle, faults):
            expect(all_drives("operation enabled")).now()
            expect(at_rest()).throughout(0.1)
            faults.add("duplicate@drive_fl:to=0")
        """
    )
    result = project.runpytest("--junitxml=junit.xml")
    result.assert_outcomes(passed=1)
    assert not (project.path / "hil-artifacts").exists()
    known = properties(project.path / "junit.xml")
    assert float(known["hil_simulated_seconds"][0]) > 0.1
    assert 0.4 < float(known["hil_bus_load_mean"][0]) < 0.7
    assert int(known["hil_frames"][0]) > 500
    assert known["hil_error_frames"] == ["0"]
    assert known["hil_seed"] == ["1"]
    assert known["hil_fault"] == ["duplicate@drive_fl:to=0.0"]


def test_a_failure_says_what_was_expected_and_found_and_leaves_recording_and_picture(project: pytest.Pytester) -> None:
    project.makepyfile(
        """
        from hil.testing import emergency

        def test_trip(expect, faults):
            faults.add("trip@drive_fl:code=0x2310")
            expect(emergency("drive_fl", 0x7121)).within(0.002)
        """
    )
    result = project.runpytest("--junitxml=junit.xml", "--hil-artifacts=kept")
    result.assert_outcomes(failed=1)
    result.stdout.re_match_lines([r".*Expected emergency 7121h of drive_fl within 0.002 s; .* it sent 2310h\."])
    recording, picture = sorted((project.path / "kept").iterdir())
    frames = list(can.LogReader(recording))
    assert any(frame.arbitration_id == 0x081 and frame.data[:2] == b"\x10\x23" for frame in frames)
    svg = ElementTree.parse(picture)
    words = " ".join(text for text in svg.getroot().itertext())
    for word in (
        "drive_fl",
        "switch on disabled",
        "fault",
        "2310h",
        "trip@drive_fl",
        "FAILED: emergency 7121h",
        "speed",
        "0 s",
    ):
        assert word in words
    known = properties(project.path / "junit.xml")
    assert known["hil_recording"] == [str(Path("kept") / recording.name)]
    assert known["hil_timeline"] == [str(Path("kept") / picture.name)]
    assert re.search(r"timeline: \S+\.svg", result.stdout.str())


def test_a_fixture_that_fails_while_it_drives_leaves_recording_and_picture_and_one_error(
    project: pytest.Pytester,
) -> None:
    project.makepyfile(
        """
        import pytest

        @pytest.fixture
        def driving(bench, faults):
            faults.add("bus_off@drive_fl")
            bench.run(0.1)
            raise RuntimeError("it does not drive")

        def test_drive(driving):
            pass
        """
    )
    result = project.runpytest("--junitxml=junit.xml")
    result.assert_outcomes(errors=1)
    recording, picture = sorted((project.path / "hil-artifacts").iterdir())
    assert properties(project.path / "junit.xml")["hil_recording"] == [f"hil-artifacts/{recording.name}"]
    assert "bus_off" in picture.read_text()


MISSPELLED = {
    "a choice of the marker": ("@pytest.mark.hil(prototyp='compact')\ndef test(bench): pass", "prototype, network"),
    "a node": ("def test(expect): expect(drive('drive_xy', 'fault'))", "drive_rr"),
    "a drive that is none": ("def test(expect): expect(drive('encoder_left', 'fault'))", "drive_rr"),
    "the sender of an emergency": ("def test(expect): expect(emergency('drive'))", "encoder_right"),
    "a symptom": ("def test(bench, allow): allow('lost hartbeat')", "lost heartbeat"),
}


@pytest.mark.parametrize(("test", "known"), MISSPELLED.values(), ids=MISSPELLED)
def test_what_is_misspelled_is_told_with_what_there_is(project: pytest.Pytester, test: str, known: str) -> None:
    project.makepyfile(f"import pytest\nfrom hil.testing import drive, emergency\n\n{test}\n")
    result = project.runpytest()
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.re_match_lines([rf"E .*UserError: .*Use .*{known}"])


def test_recordings_of_all_tests_are_kept_when_asked_for(project: pytest.Pytester) -> None:
    project.makepyfile("def test_nothing(bench):\n    bench.run(0.1)\n")
    project.runpytest("--hil-keep=all").assert_outcomes(passed=1)
    assert len(list((project.path / "hil-artifacts").iterdir())) == 2


def test_a_bus_that_is_not_well_is_an_error_at_the_end_unless_it_is_allowed(project: pytest.Pytester) -> None:
    project.makepyfile(
        """
        def test_sick(bench, faults):
            faults.add("bus_off@encoder_left")
            bench.run(0.01)

        def test_allowed(bench, faults, allow):
            allow("error frames")
            faults.add("bus_off@encoder_left")
            bench.run(0.01)
        """
    )
    result = project.runpytest()
    result.assert_outcomes(passed=2, errors=1)
    result.stdout.fnmatch_lines(["*error frames: 32 error frames", '*allow("error frames")*'])


def test_a_test_that_has_failed_is_not_failed_again_by_the_bus(project: pytest.Pytester) -> None:
    project.makepyfile(
        """
        def test_wrong(bench, faults):
            faults.add("bus_off@drive_fl")
            assert False
        """
    )
    project.runpytest().assert_outcomes(failed=1)


def test_the_marker_says_which_bench(project: pytest.Pytester) -> None:
    project.makepyfile(
        """
        import pytest

        @pytest.mark.hil(prototype="compact", seed=4, noise=0.0)
        def test_compact(bench):
            assert bench.network.name == "compact"
            assert bench.vehicle.drives[0].measured_torque() == 0.0

        def test_default(bench):
            assert bench.network.name == "prototype"
        """
    )
    project.runpytest("--strict-markers").assert_outcomes(passed=2)


def test_the_fixtures_are_listed_with_what_they_are(project: pytest.Pytester) -> None:
    result = project.runpytest("--fixtures")
    for name in ("bench", "bus", "vehicle", "clock", "faults", "expect", "allow"):
        assert re.search(rf"^{name} -- .*plugin.py", result.stdout.str(), re.MULTILINE), name


def test_a_project_without_such_tests_pays_nothing(project: pytest.Pytester) -> None:
    (project.path / "conftest.py").unlink()
    project.makepyfile(
        """
        import sys

        def test_light():
            heavy = [name for name in ("can", "pybullet", "casadi", "emulator", "numpy") if name in sys.modules]
            assert not heavy
        """
    )
    project.runpytest_subprocess("-p", "no:hypothesispytest", "-p", "no:benchmark").assert_outcomes(passed=1)
