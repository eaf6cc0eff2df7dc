"""What the diagnosing side sees: records and a model, neither the emulator nor a hint."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hil.exam.folder import ExamFolder, read_exam
from hil.exam.record_bytes import record_bytes, record_from_bytes
from ident.errors import UserError
from ident.records.record import Record, Segment
from ident.writing import write_whole


def some_record(seed: int, samples: int = 500) -> Record:
    generator = np.random.default_rng(seed)
    scale = 10.0 ** generator.integers(-3, 3)
    return Record(
        [
            Segment(
                step="straight",
                sample_time=0.002,
                time=np.arange(samples) * 0.002,
                motor_torques=scale * generator.normal(size=(samples, 4)),
                wheel_angles=np.cumsum(generator.normal(size=(samples, 4)), axis=0),
                steering_angles=np.zeros((samples, 2)),
                period=np.repeat([-1, 0, 1, 2, 3], samples // 5),
                command_torques=np.ones((samples, 4)),
            )
        ],
        "record",
    )


def test_records_of_one_length_are_files_of_one_size() -> None:
    assert len({len(record_bytes(some_record(seed))) for seed in range(8)}) == 1


def test_a_record_comes_back_bit_by_bit_without_its_commands() -> None:
    record = some_record(3)
    (back,) = record_from_bytes(record_bytes(record), "back").segments
    (segment,) = record.segments
    assert np.array_equal(back.motor_torques, segment.motor_torques)
    assert np.array_equal(back.wheel_angles, segment.wheel_angles)
    assert np.array_equal(back.period, segment.period)
    assert back.command_torques is None


def test_an_exam_of_another_version_is_refused(tmp_path: Path) -> None:
    folder = ExamFolder(tmp_path)
    write_whole('{"schema": "quasiomni.exam/2", "plans": ["one"]}', folder.manifest)
    with pytest.raises(UserError, match="exam/2, not") as refused:
        read_exam(folder)
    assert "seal the exam again" in refused.value.remedy


PROGRAM = """
import sys
import quasiomni.exam
from hil.exam.diagnosing import forbid_emulator
assert not {"emulator", "pybullet"} & set(sys.modules), "loaded by the command line"
forbid_emulator()
try:
    import emulator.vehicle
except ImportError as error:
    print(error)
"""


def run(program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)


def test_the_diagnosing_process_cannot_import_the_emulator() -> None:
    done = run(PROGRAM)
    assert done.returncode == 0, done.stderr
    assert "must not import emulator" in done.stdout


def test_a_process_that_knows_the_emulator_may_not_diagnose() -> None:
    done = run("import emulator.vehicle\nfrom hil.exam.diagnosing import forbid_emulator\nforbid_emulator()")
    assert done.returncode != 0
    assert "has imported emulator" in done.stderr
