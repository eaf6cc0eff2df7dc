"""Sound files of every kind that is read, small ones, and what is true in them."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.campaign.creating import create_run
from hil.campaign.folder import Run, RunFolder
from hil.campaign.reading import read_logs
from hil.frames.mcap_log import McapFrames
from hil.frames.recorder import Recorder
from hil.master import Master
from hil.network import DEFAULT_NETWORK, load_network
from ident.campaign.plan import make_plan
from ident.effects.extended import ExtendedModel
from ident.estimate.result import KnownInertia
from ident.parameters_file import write_model
from ident.records.files import write_record
from ident.records.record import Record, Segment, Step, make_segment
from ident.vehicle.description import find_data_file, load_vehicle

CYCLES = 300
SAMPLES = 400


@dataclass(frozen=True)
class Material:
    """A sound file.

    Attributes:
        name: of the format.
        kind: how it is opened.
        folder: in which it lies with the files that it needs.
        file: its name in the folder.
        binary: damaged as bytes, else as text.
    """

    name: str
    kind: str
    folder: Path
    file: str
    binary: bool

    @property
    def path(self) -> Path:
        """The file itself."""
        return self.folder / self.file


def make_material(folder: Path) -> list[Material]:
    """Write all of them; truths of logs and records go to `log.npz` and `record.npz`."""
    folder.mkdir(parents=True, exist_ok=True)
    return [*_logs(folder), *_records(folder), *_settings(folder)]


def save_truth(record: Record, path: Path) -> None:
    """The channels of a record, and how far a value may be off: four standard deviations of its noise."""
    (segment,) = record.segments
    values = np.hstack([segment.motor_torques, segment.wheel_angles, segment.steering_angles])
    np.savez(path, time=segment.time, values=values)


def _logs(folder: Path) -> Iterator[Material]:
    recorded = _drive(folder / "recorded")
    save_truth(read_logs([recorded], load_network()), folder / "log.npz")
    with can.BLFReader(recorded) as reader:
        messages = list(reader)
    writers: dict[str, tuple[str, Callable[[Path], can.io.generic.MessageWriter | McapFrames]]] = {
        "blf packed": (".blf", lambda path: can.BLFWriter(path, max_container_size=16384)),
        "blf stored": (".blf", lambda path: can.BLFWriter(path, compression_level=0, max_container_size=16384)),
        "blf with error frames": (".blf", can.BLFWriter),
        "asc": (".asc", can.ASCWriter),
        "candump": (".log", can.CanutilsLogWriter),
        "mf4 frames": (".mf4", can.MF4Writer),
        "mf4 frames, stored": (".mf4", lambda path: can.MF4Writer(path, compression_level=0)),
        "mcap frames": (".mcap", McapFrames),
    }
    for name, (suffix, make) in writers.items():
        material = Material(name, "log", folder / name, f"000_straight{suffix}", suffix not in (".asc", ".log"))
        material.folder.mkdir()
        with make(material.path) as writer:
            for number, message in enumerate(messages):
                if "error" in name and number % 100 == 0:
                    writer.on_message_received(can.Message(timestamp=message.timestamp, is_error_frame=True))
                writer.on_message_received(message)
        yield material


def _drive(folder: Path) -> Path:
    vehicle, recorder = Flywheels(), Recorder(folder)
    with LockstepBench(vehicle) as bench, Master(bench.bus, bench.clock, load_network(), recorder) as master:
        master.boot()
        master.enable()
        with recorder.step("straight") as path:
            for k in range(CYCLES):
                master.exchange([0.3 * math.sin(0.07 * k + wheel) for wheel in range(4)])
        recorder.close()
    return path


def _records(folder: Path) -> Iterator[Material]:
    rng = np.random.default_rng(4)
    time = np.arange(SAMPLES) * 0.002
    phase = 2 * np.pi * time[:, None] / 0.4 + np.arange(4)
    segment = Segment(
        step="straight",
        sample_time=0.002,
        time=time,
        motor_torques=0.5 * np.sin(phase) + 0.01 * rng.normal(size=(SAMPLES, 4)),
        wheel_angles=2.0 * np.cos(phase) + 1e-4 * rng.normal(size=(SAMPLES, 4)),
        steering_angles=0.1 * np.cos(phase[:, :2]) + 1e-5 * rng.normal(size=(SAMPLES, 2)),
        period=np.repeat([0, 1, 2, 3], SAMPLES // 4),
    )
    record = Record([make_segment(segment, "material")])
    save_truth(record, folder / "record.npz")
    for suffix in (".csv", ".parquet", ".mf4", ".mcap"):
        material = Material(
            f"{suffix[1:]} record", "record", folder / f"record{suffix}", f"record{suffix}", suffix != ".csv"
        )
        material.folder.mkdir()
        write_record(record, material.path)
        yield material


def _settings(folder: Path) -> Iterator[Material]:
    vehicle = find_data_file("ident.vehicle", "prototype")
    for name, source in (("vehicle", vehicle), ("network", DEFAULT_NETWORK)):
        material = Material(f"{name} file", name, folder / name, f"{name}.toml", False)
        material.folder.mkdir()
        shutil.copyfile(source, material.path)
        yield material
    for eds in DEFAULT_NETWORK.parent.glob("*.eds"):
        shutil.copyfile(eds, folder / "network" / eds.name)
    yield Material("eds", "network", folder / "network", "drive.eds", False)
    inertia = KnownInertia(0.121, 0.001, "given")
    plan = make_plan(load_vehicle(), np.random.default_rng(1), steps=[Step.STRAIGHT], periods=4, cycle=0.002)
    create_run(Run(RunFolder(folder / "run"), plan, load_network(), 1, "emulator", "prototype", inertia), vehicle)
    yield Material("run.json", "run", folder / "run", "run.json", False)
    model = folder / "model"
    model.mkdir()
    write_model(ExtendedModel(load_vehicle().prior, ()), model / "parameters.toml", {"run": "material"})
    yield Material("parameters.toml", "model", model, "parameters.toml", False)
