"""FMUs with a bus terminal in the tools of others: FMPy, and containers of the FMU manipulation toolbox."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from pathlib import Path
from shutil import copytree
from xml.etree.ElementTree import fromstring

import pytest

from fmu.bus.description import LAYERED_STANDARD, RX_CLOCK, TX_CLOCK
from fmu.bus.packaging import build_bus_fmu, vehicle_plant
from fmu.bus.shaft_plant import shaft_plant
from fmu.bus.system import TxClock
from fmu.compiling import find_compiler
from fmu.platforms import host_platform
from fmu.source import ModelSource
from hil.lsbus.instance import BusFmuInstance
from hil.lsbus.operations import CanFrame, frames, transmit
from hil.lsbus.system import drive_on_bus, vehicle_on_bus
from hil.network import DEFAULT_NETWORK
from tests.hil.lsbus.stimuli import read
from tests.hil.lsbus.twins import silent_prototype


def build_drive(role: str, tx_clock: TxClock, path: Path, network: Path = DEFAULT_NETWORK) -> Path:
    system = drive_on_bus(silent_prototype(), network, role, tx_clock)
    path.write_bytes(build_bus_fmu(shaft_plant(role), system, {}, (host_platform(),), find_compiler()))
    return path


@pytest.fixture(scope="module", params=list(TxClock))
def drive_fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_drive("drive_fl", request.param, tmp_path_factory.mktemp("drive") / "drive_fl.fmu")


def test_fmpy_finds_nothing_wrong(bus_fmu: Path, drive_fmu: Path) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(bus_fmu)) == []
    assert validate_fmu(str(drive_fmu)) == []


def test_the_toolbox_finds_nothing_wrong(bus_fmu: Path) -> None:
    call = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmutool", "-input", str(bus_fmu), "-check"]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    assert "compliant with FMI-3.0" in done.stderr + done.stdout


def test_the_archive_says_that_it_is_of_the_layered_standard(bus_fmu: Path) -> None:
    with zipfile.ZipFile(bus_fmu) as archive:
        manifest = fromstring(archive.read(f"extra/{LAYERED_STANDARD}/fmi-ls-manifest.xml"))
        terminals = fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        eds = archive.read("resources/drive_fl.eds").decode()
    values = {re.sub(r"\{.*\}", "", name): value for name, value in manifest.attrib.items()}
    assert values["fmi-ls-name"] == LAYERED_STANDARD
    assert values["fmi-ls-version"] == "1.0.0"
    (terminal,) = terminals.iter("Terminal")
    assert terminal.get("terminalKind") == "org.fmi-ls-bus.network-terminal"
    assert terminal.get("matchingRule") == "org.fmi-ls-bus.transceiver"
    assert {member.get("memberName") for member in terminal} == {"Rx_Data", "Rx_Clock", "Tx_Data", "Tx_Clock"}
    assert "[6040]" in eds
    assert "[607A]" not in eds


def test_both_kinds_of_clock_send_the_same(drive_fmu: Path) -> None:
    with BusFmuInstance(drive_fmu, {}) as instance:
        assert {TX_CLOCK, RX_CLOCK} <= set(instance.names)
        assert list(frames(instance.take())) == [CanFrame(0x701, b"\x00")]
        instance.give(transmit(CanFrame(0x601, read(1, 0x1000).data)))
        assert list(frames(instance.take())) == [CanFrame(0x581, bytes.fromhex("4300100092010200"))]
        assert instance.next_tick == float("inf")


def network_with(folder: Path, entry: str, value: str) -> Path:
    """A network file whose drives have another value of an object from power-on."""
    copytree(DEFAULT_NETWORK.parent, folder)
    eds = folder / "drive.eds"
    eds.write_text(re.sub(rf"(?s)(\[{entry}\].*?DefaultValue=)[^\n]*", rf"\g<1>{value}", eds.read_text(), count=1))
    return folder / DEFAULT_NETWORK.name


@pytest.fixture
def container(tmp_path: Path) -> Path:
    """Two drives with their terminals on each other: one beats every 0.1 s, the one before it watches for 0.05 s."""
    from fmu_manipulation_toolbox.assembly import Assembly

    entries = {"drive_rl": ("1016sub1", "0x00010032"), "drive_fl": ("1017", "100")}
    for role, entry in entries.items():
        build_drive(role, TxClock.TRIGGERED, tmp_path / f"{role}.fmu", network_with(tmp_path / role, *entry))
    (tmp_path / "pair.json").write_text(
        '{"name": "pair.fmu", "fmu": ["drive_rl.fmu", "drive_fl.fmu"], "step_size": 0.01, '
        '"link": [["drive_rl.fmu", "CAN", "drive_fl.fmu", "CAN"]]}'
    )
    Assembly("pair.json", fmu_directory=tmp_path).make_fmu(fmi_version=3, datalog=True)
    return tmp_path / "pair.fmu"


def test_a_container_takes_the_frames_of_two_drives_and_one_hears_the_other(
    container: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the ticks of their clocks. Who misses a heartbeat has heard the one before: EMCY 8130h of node 2."""
    from fmpy.simulation import simulate_fmu

    monkeypatch.chdir(tmp_path)
    simulate_fmu(str(container), step_size=0.01, stop_time=0.3, output_interval=0.01, relative_tolerance=1e-9)
    (log,) = tmp_path.glob("*datalog.csv")
    rows = re.findall(r"(?<=,)(?:[0-9A-F]{2}){16,}(?=,)", log.read_text())
    seen = {frame for row in rows for frame in frames(bytes.fromhex(row))}
    boot_up = {CanFrame(0x700 + node, b"\x00") for node in (1, 2)}
    missed = CanFrame(0x082, bytes.fromhex("3081110100000000"))
    assert seen == {*boot_up, CanFrame(0x701, b"\x7f"), missed}


def test_the_same_run_gives_the_same_bytes(source: ModelSource, bus_fmu: Path) -> None:
    system = vehicle_on_bus(silent_prototype(), DEFAULT_NETWORK)
    again = build_bus_fmu(vehicle_plant(source), system, {}, (host_platform(),), find_compiler())
    assert again == bus_fmu.read_bytes()
