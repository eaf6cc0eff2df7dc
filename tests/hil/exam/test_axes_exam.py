"""An exam of axes: sizes are what they are said to be, all follows from a seed, and it is diagnosed and scored."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.exam.axes.drawing import Question, draw_axis_cases, machine_of, sized_case
from hil.exam.axes.effects import MISSING, machine_with
from hil.exam.axes.record_bytes import axis_record_bytes, axis_record_of
from hil.exam.axes.sizes import Ruler
from hil.exam.cases import Kind
from hil.exam.drawing import Composition, composition_of
from hil.exam.lots import lots_of_seed
from hil.exam.score_names import ORACLE
from hil.exam.sources import Source
from hil.exam.sources.machine import Machine
from ident.diagnosis.axis.diagnose import pose_axis
from ident.diagnosis.axis.reference import axis_reference
from ident.diagnosis.search.known import NOTHING, log_evidence_of
from ident.errors import UserError

SEED = 6100001


@pytest.mark.parametrize("name", ["asymmetric_viscous", "torque_ripple", "law_angle"])
def test_a_size_is_as_many_noise_units_as_were_asked_for(name: str) -> None:
    case = sized_case(Question(Kind.EFFECT, (name,), 0.5, (1.0,)), "case", SEED)
    machine, _ = machine_of(case.seed, case.excitation)
    (effect,) = case.effects
    assert Ruler(machine, case.seed).units(name, effect.size, effect.values) == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("name", [name for name, missing in MISSING.items() if missing.as_met])
def test_what_is_as_large_as_one_meets_it_shows_above_the_noise(name: str) -> None:
    case = sized_case(Question(Kind.EFFECT, (name,), 1.0, (1.0,)), "case", SEED)
    machine, _ = machine_of(case.seed, case.excitation)
    (effect,) = case.effects
    assert Ruler(machine, case.seed).units(name, effect.size, effect.values) >= 1.0


@pytest.mark.parametrize("seed", range(SEED, SEED + 6))
def test_a_machine_with_two_things_amiss_still_goes_where_it_is_told(seed: int) -> None:
    """A late drive and a soft spring make some loops unstable that are stable with either."""
    case = sized_case(Question(Kind.PAIR, ("time_delay", "elasticity"), 1.0, (1.0, 1.0)), "case", seed)
    machine, _ = machine_of(case.seed, case.excitation)
    position = machine_with(machine, case.effects).drive(case.seed).axes[0].position
    assert np.ptp(position) < 2 * np.ptp(machine.drive(case.seed).axes[0].position)


def test_everything_follows_from_the_seed() -> None:
    composition = Composition(effects=2, pairs=1, none=1, unknown=0, invisible=0, laws=1, faults=0)

    def drawn() -> list[object]:
        return [
            *draw_axis_cases(composition, lots_of_seed(SEED), lambda function, tasks: (function(*t) for t in tasks))
        ]

    assert drawn() == drawn()


def test_a_record_is_the_same_behind_its_file() -> None:
    machine, _ = machine_of(SEED, 0)
    record = replace(machine_with(machine, ()), duration=2.0).drive(1)
    again = axis_record_of(axis_record_bytes(record), "again")
    assert (again.axes[0].position == record.axes[0].position).all()
    assert (again.axes[0].effort == record.axes[0].effort).all()
    assert again.sample_time == pytest.approx(record.sample_time)


def test_a_source_has_by_default_the_kinds_that_it_can_have() -> None:
    assert composition_of(Source.AXES, {"effects": 3, "unknown": None}) == replace(
        Composition(), effects=3, unknown=0, invisible=0, faults=0
    )
    assert composition_of(Source.EMULATOR, {"unknown": None}) == Composition()


def test_axes_have_no_faults() -> None:
    with pytest.raises(UserError, match="no cases of the kind fault"):
        draw_axis_cases(Composition(unknown=0, invisible=0), lots_of_seed(SEED), lambda function, tasks: iter(()))


def quasiomni(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "quasiomni", *arguments], capture_output=True, text=True, timeout=600, check=False
    )


def test_it_is_sealed_diagnosed_and_scored(tmp_path: Path) -> None:
    out, key = str(tmp_path / "exam"), ("--key", str(tmp_path / "exam.key"))
    kinds = ("--effects", "1", "--pairs", "0", "--none", "1", "--laws", "1", "--jobs", "1")
    sealed = quasiomni("exam", "seal", "--source", "axes", "--out", out, *key, *kinds)
    assert sealed.returncode == 0, sealed.stderr
    early = quasiomni("exam", "diagnose", out, "--oracle", *key)
    assert early.returncode == 2
    assert "not diagnosed yet" in " ".join(early.stderr.split())
    for option in ([], ["--without-true-candidate", *key], ["--oracle", *key]):
        diagnosed = quasiomni("exam", "diagnose", out, "--jobs", "1", *option)
        assert diagnosed.returncode == 0, diagnosed.stderr
    scored = quasiomni("exam", "score", out, *key)
    assert scored.returncode == 0, scored.stderr
    score = json.loads((tmp_path / "exam" / "score.json").read_text())
    assert (score["cases"], score["sealed"], score["missing"]) == (3, True, {})
    assert sum(name.startswith(ORACLE) for name in score["rates"]) == 1
    for answer in (tmp_path / "exam" / "oracle").iterdir():
        answer.write_text(json.dumps(dict.fromkeys(json.loads(answer.read_text()))))
    blind = quasiomni("exam", "score", out, *key)
    assert blind.returncode == 0, blind.stderr
    for record in (tmp_path / "exam" / "cases").iterdir():
        record.unlink()
    for option in ([], ["--oracle", *key]):
        empty = quasiomni("exam", "diagnose", out, *option)
        assert empty.returncode == 2
        assert "holds no records yet" in " ".join(empty.stderr.split())


def test_an_oracle_that_knows_the_truth_is_not_asked_without_it(tmp_path: Path) -> None:
    refused = quasiomni("exam", "diagnose", str(tmp_path), "--oracle", "--without-true-candidate")
    assert refused.returncode == 2
    assert "cannot be left out" in " ".join(refused.stderr.split())


def test_an_oracle_finds_a_cause_that_is_there_and_hardly_one_that_is_not() -> None:
    """Evidence of the true candidate, against that of the same one in the same machine without it."""
    case = sized_case(Question(Kind.EFFECT, ("asymmetric_viscous",), 1.0, (1.0,)), "case", SEED)
    machine, _ = machine_of(case.seed, case.excitation)
    key = f"{case.effects[0].name}@{case.effects[0].where}"

    def evidence(lacking: Machine) -> float:
        records = [lacking.drive(seed) for seed in (case.seed, case.seed + 1)]
        problems = pose_axis(records[:1], records[1:], axis_reference(records[:1], None, records[1:]))
        found = log_evidence_of(*problems, (key, "backlash@nowhere"))
        assert found["backlash@nowhere"] == NOTHING
        return found[key]

    assert evidence(machine_with(machine, case.effects)) > 10
    assert evidence(machine) < 3


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--vehicle", "compact"), "takes no --vehicle"),
        (("--engine", "mujoco"), "takes no --engine"),
        (("--faults", "2"), "no cases of the kind fault"),
    ],
)
def test_what_axes_do_not_have_is_refused(given: tuple[str, str], said: str, tmp_path: Path) -> None:
    out = tmp_path / "exam"
    refused = quasiomni("exam", "seal", "--source", "axes", "--out", str(out), "--first-seed", "7", *given)
    assert refused.returncode == 2
    assert said in " ".join(refused.stderr.split())
    assert not (out / "exam.json").exists()
