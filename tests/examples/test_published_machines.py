"""Published records of real machines: what is done to them and what is expected of them, without any of them."""

import importlib
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import io

from ident.diagnosis.axis.model import AxisEffect
from ident.diagnosis.dependence import Partner, Variable
from ident.diagnosis.diagnosis import Alternative, Diagnosis, Gap, NamedEffect, Verdict
from ident.diagnosis.names import EffectName
from ident.records.axis_record import AxisKind, AxisRecord, AxisSignals

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def load(monkeypatch: pytest.MonkeyPatch) -> Any:
    """An example as a module."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module


@pytest.fixture
def records(load: Any) -> ModuleType:
    return load("published_records")  # type: ignore[no-any-return]


@pytest.fixture
def machines(load: Any) -> ModuleType:
    return load("published_machines")  # type: ignore[no-any-return]


@pytest.fixture
def outcomes(load: Any) -> ModuleType:
    return load("published_outcomes")  # type: ignore[no-any-return]


def test_a_record_with_uneven_time_is_put_on_a_uniform_one_and_states_its_units(
    records: ModuleType, tmp_path: Path
) -> None:
    time = np.arange(500) * 0.002
    time[100:] += 0.001
    table = np.column_stack([time, np.sin(time), 2 * time, np.zeros((500, 2)), 3 * time, 4 * time])
    file = tmp_path / "measured.csv"
    np.savetxt(file, table, delimiter=",", header="time,pos1,pos2,vel1,vel2,tau1,tau2", comments="")
    made = records.record(records.read_double_pendulum(file), ("1", "2"), "measured")
    assert [(axis.name, axis.kind, axis.assumed) for axis in made.axes] == [
        ("1", AxisKind.ROTARY, False),
        ("2", AxisKind.ROTARY, False),
    ]
    assert made.sample_time == pytest.approx(0.002)
    assert made.axes[1].position == pytest.approx(2 * made.time)
    assert made.axes[1].effort == pytest.approx(4 * made.time)


def test_motor_torques_of_a_robot_become_those_of_its_joints_and_degrees_radians(
    records: ModuleType, tmp_path: Path
) -> None:
    file = tmp_path / "data.mat"
    degrees = np.linspace(0, 180, 6 * 200).reshape(6, 200)
    recorded = {"time_cont": np.arange(200) * 0.004, "act_pos_mot_deg": degrees, "act_torque_abs_nm": np.ones((6, 200))}
    io.savemat(file, {"rec": recorded, "para": {"u": np.arange(100.0, 700.0, 100.0)}})
    made = records.record(records.read_kr300(file), ("3",), "data")
    (axis,) = made.axes
    assert axis.name == ""
    assert axis.position == pytest.approx(np.radians(degrees[2]))
    assert axis.effort == pytest.approx(np.full(200, 300.0))


def test_currents_of_a_screw_become_forces(records: ModuleType, tmp_path: Path) -> None:
    file = tmp_path / "LinA" / "data" / "sweep.txt"
    file.parent.mkdir(parents=True)
    milliseconds = np.arange(0, 1000, 10)
    np.savetxt(
        file, np.column_stack([milliseconds, *[np.ones(100)] * 2, milliseconds / 500, np.ones(100), [1000.0] * 100])
    )
    made = records.record(records.read_linear_actuator(file), ("1",), "sweep")
    (axis,) = made.axes
    assert axis.kind is AxisKind.LINEAR
    assert made.sample_time == pytest.approx(0.01)
    assert axis.position[-1] == pytest.approx(990 / 500 / 1000)
    assert axis.effort == pytest.approx(np.full(100, 0.0429 * 1000 * 2 * np.pi * 85.58 / 24))


def test_every_expectation_is_of_an_axis_of_its_row_and_of_a_cause_that_there_is(machines: ModuleType) -> None:
    laws = {f"law {variable}" + (f" x {partner}" if partner else "") for variable in Variable for partner in Partner}
    for row in machines.ROWS:
        places = {"axis"} if len(row.axes) == 1 else {f"axis_{axis}" for axis in row.axes}
        assert set(row.expected) == set(row.closed) == places, row.title
        for causes in row.expected.values():
            assert causes
            assert set(causes) <= {machines.NONE, *EffectName, *AxisEffect, *laws}, row.title
        assert row.fit
        assert all(-1 <= share <= 1 for share in row.closed.values())


def test_every_machine_has_rows_and_every_row_a_machine(machines: ModuleType) -> None:
    assert {row.machine for row in machines.ROWS} == set(machines.MACHINES)
    names = [(row.machine, row.title) for row in machines.ROWS]
    assert len(set(names)) == len(names)


def test_rows_without_records_say_where_to_get_them(machines: ModuleType, tmp_path: Path) -> None:
    header, _, *rows = machines.lines(tmp_path, ["kr300"])
    assert header.startswith("| machine |")
    assert len(rows) == sum(row.machine == "kr300" for row in machines.ROWS)
    for row in rows:
        assert "skipped" in row
        assert "git clone https://github.com/JonasWeigand/Robot_Identification" in row


def test_without_a_folder_the_command_says_what_to_name(
    machines: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv(machines.FOLDER, raising=False)
    monkeypatch.setattr("sys.argv", ["published_machines.py"])
    with pytest.raises(SystemExit):
        machines.main()
    assert machines.FOLDER in capsys.readouterr().err


def _answer(verdict: Verdict, **closed: float) -> Diagnosis:
    effects = [NamedEffect(name, "axis", {}, 0.9, (name,), share) for name, share in closed.items()]
    return Diagnosis(verdict, tuple(effects), (), Gap(3.0, 1.0, 1.0), (), None)


@pytest.mark.parametrize(
    ("expected", "answer", "outcome"),
    [
        (("stribeck",), _answer(Verdict.EFFECT, stribeck=0.8), "right"),
        (("stribeck",), _answer(Verdict.EFFECT, stribeck=0.8, com_offset=0.1), "right"),
        (("stribeck",), _answer(Verdict.EFFECT, stribeck=0.1, com_offset=0.8), "wrong"),
        (("stribeck",), _answer(Verdict.EFFECT, quadratic_drag=0.8), "right variable"),
        (("stribeck",), _answer(Verdict.UNKNOWN), "unknown"),
        (("stribeck",), _answer(Verdict.NONE), "missed"),
        (("none",), _answer(Verdict.NONE), "right"),
        (("none",), _answer(Verdict.UNKNOWN), "unknown"),
        (("none",), _answer(Verdict.EFFECT, stribeck=0.8), "wrong"),
    ],
)
def test_the_cause_that_closes_most_decides(
    outcomes: ModuleType, expected: tuple[str, ...], answer: Diagnosis, outcome: str
) -> None:
    row = outcomes.Row("m", "t", ("1",), ("f",), (), 1.0, {"axis": expected}, {"axis": 0.5})
    assert outcomes.outcome_of(row, answer).value == outcome


def test_what_records_do_not_tell_from_an_answer_is_in_its_set(outcomes: ModuleType) -> None:
    row = outcomes.Row("m", "t", ("1",), ("f",), (), 1.0, {"axis": outcomes.GRAVITY}, {"axis": 0.5})
    answer = _answer(Verdict.LAW, friction_warming=0.8)
    alike = replace(answer.effects[0], alternatives=(Alternative(None, str(Variable.OTHER_AXIS), "axis"),))
    assert outcomes.outcome_of(row, answer).value == "wrong"
    assert outcomes.outcome_of(row, replace(answer, effects=(alike,))).value == "in its set"


def test_least_squares_alone_find_the_gravity_of_a_swinging_arm(load: Any) -> None:
    held_out = load("held_out_laws")
    time = np.arange(0, 40, 0.01)
    angle = 1.2 * np.sin(2 * np.pi * 0.2 * time) + 0.7 * np.sin(2 * np.pi * 0.33 * time)
    speed = np.gradient(angle, time)
    noise = np.random.default_rng(1).normal(scale=0.01, size=len(time))
    effort = 0.5 * np.gradient(speed, time) + 0.2 * speed + 0.3 * np.sign(speed) + 4.0 * np.sin(angle) + noise
    axis = AxisSignals("", AxisKind.ROTARY, angle, effort)
    record = AxisRecord((axis,), 0.01, time, np.full(len(time), -1))
    first, second, *_ = held_out.report("arm", held_out.parts_of([record], [], "", 5.0))
    assert first.startswith("arm: effort")
    assert second.strip().startswith("gravity over own position")


def test_friction_at_rest_is_no_law_of_anything(load: Any) -> None:
    """At rest the effort is what it was when the axis came to rest: a function of time, if rows at rest count."""
    held_out = load("held_out_laws")
    time = np.arange(0, 60, 0.01)
    phase = np.minimum(time % 6.0, 3.0)
    angle = (0.4 + 0.02 * time) * np.sin(2 * np.pi * phase / 3.0) ** 2
    speed = np.gradient(angle, time)
    held = np.interp(time, np.arange(0, 66, 6.0), 0.9 * np.sin(np.arange(11.0)))
    friction = np.where(np.abs(speed) > 1e-9, np.sign(speed), held)
    noise = np.random.default_rng(1).normal(scale=0.01, size=len(time))
    effort = 0.5 * np.gradient(speed, time) + 0.2 * speed + friction + noise
    record = AxisRecord((AxisSignals("", AxisKind.ROTARY, angle, effort),), 0.01, time, np.full(len(time), -1))

    def gap(moving: float) -> float:
        first = next(iter(held_out.report("arm", held_out.parts_of([record], [], "", 5.0, moving))))
        return float(first.rpartition(" ")[2])

    assert gap(0.0) > 0.2
    assert gap(0.05) < 0.1 * gap(0.0)


def test_what_causes_predict_is_the_share_of_what_was_missed_that_is_gone(machines: ModuleType) -> None:
    block = SimpleNamespace(target=np.array([3.0, 4.0, 99.0]), moving=np.array([True, True, False]))
    held_out = SimpleNamespace(
        problem=SimpleNamespace(blocks=[block]), before=[np.zeros(3)], after=[np.array([3.0, 2.0, 0.0])]
    )
    assert machines.predicted_share(held_out) == pytest.approx(1 - 4 / 25)
