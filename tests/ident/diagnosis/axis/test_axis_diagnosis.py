"""Servo axes: machines that know nothing of the candidates, and a real one."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hil.exam.sources.machine import Machine
from ident.diagnosis.answer.findings import Findings
from ident.diagnosis.axis.candidates import in_gap
from ident.diagnosis.axis.diagnose import diagnose_axis
from ident.diagnosis.axis.late import likelier_scales
from ident.diagnosis.axis.motion import with_repeats
from ident.diagnosis.axis.reference import axis_reference
from ident.diagnosis.diagnosis import Verdict
from ident.diagnosis.observations.delays import DAMPING, delayed, sprung
from ident.errors import EstimationError, RecordError
from ident.estimate.filters import SEVEN, differentiate, zero_phase
from ident.records.axis_record import AxisRecord, read_axis_record
from ident.report.gap_summary import next_text, summary_lines
from ident.report.headline import headline

Make = Callable[..., Any]


def _diagnosed(machine: Any) -> Findings:
    return diagnose_axis([machine.drive(11)], [machine.drive(12)], seed=1)


def _value(findings: Findings, name: str, parameter: int = 0) -> tuple[float, float]:
    part = next(cause.part for cause in findings.causes if cause.candidate.effect == name)
    return float(part.values[parameter]), float(part.std[parameter])


def test_a_machine_that_is_the_model_lacks_nothing(machine: Make) -> None:
    stages: list[str] = []
    findings = diagnose_axis([machine().drive(11)], [machine().drive(12)], seed=1, stage=stages.append)
    # Who waits is told what is done, in the order in which it is.
    assert [stage.split()[0] for stage in stages] == ["filter", "comparing", "numbers"]
    assert findings.verdict is Verdict.NONE
    found = dict(zip(findings.problem.names, findings.after.baseline.tolist(), strict=True))
    assert found.pop("lag") == pytest.approx(0.0, abs=0.05)
    assert found.pop("hold") == pytest.approx(-1 / 24, abs=1 / 12)
    assert found == pytest.approx({"M": 20.0, "Fv": 60.0, "Fc": 8.0, "offset": -1.0}, rel=0.01)


@pytest.mark.parametrize("read", [0.0, 0.75])
def test_an_effort_that_is_held_over_its_sample_is_no_gap(machine: Make, read: float) -> None:
    """Drives hold the effort while the position is read at the start of the interval, or late in it."""
    assert _diagnosed(machine(read=read)).verdict is Verdict.NONE


def test_beside_a_held_effort_a_cause_is_found_with_its_size(machine: Make) -> None:
    findings = _diagnosed(machine(read=0.0, asymmetry=8.0))
    assert [str(cause.candidate.effect) for cause in findings.causes] == ["asymmetric_viscous"]
    value, std = _value(findings, "asymmetric_viscous")
    assert value == pytest.approx(8.0, abs=max(3 * std, 0.1))


def test_a_delay_is_named_with_all_of_its_length_beside_a_held_effort(machine: Make) -> None:
    findings = _diagnosed(machine(read=0.0, delay=0.001))
    assert [str(cause.candidate.effect) for cause in findings.causes] == ["time_delay"]
    assert _value(findings, "time_delay")[0] == pytest.approx(0.0015, rel=0.02)


def test_a_spring_that_the_library_does_not_have_is_a_law_of_the_position_and_no_ripple(machine: Make) -> None:
    """Half a period of a sine of the position looks like it."""
    findings = _diagnosed(machine(spring=100.0))
    assert findings.verdict is Verdict.LAW
    (cause,) = findings.causes
    assert cause.law_answer is not None
    assert (cause.law_answer.variable, cause.law_answer.partner) == ("angle", "")
    x, force, std = cause.law_answer.curve.T
    assert np.gradient(force, x) == pytest.approx(100.0, rel=0.05)
    assert std.max() < 0.05


def test_friction_that_depends_on_direction_is_named_with_its_size(machine: Make) -> None:
    findings = _diagnosed(machine(asymmetry=8.0))
    assert [str(cause.candidate.effect) for cause in findings.causes] == ["asymmetric_viscous"]
    value, std = _value(findings, "asymmetric_viscous")
    assert value == pytest.approx(8.0, abs=max(3 * std, 0.1))
    assert findings.gap.closed > 0.9


def test_a_wave_behind_a_spring_is_as_much_larger_as_its_resonance_says() -> None:
    time, omega, resonance = np.arange(12000) * 1e-3, 2 * np.pi * 5, 2 * np.pi * 8
    share = omega / resonance
    gain = omega**2 / (1 - share**2 + 2j * DAMPING * share)
    expected = np.real(gain * np.exp(1j * omega * time))
    found = sprung(np.cos(omega * time), resonance, 1e-3)
    np.testing.assert_allclose(found[4000:-4000], expected[4000:-4000], atol=0.01 * abs(gain))


def test_a_load_that_hardly_loses_anything_rings_on_and_not_before_it_was_pushed() -> None:
    """A push at 2 s of a record of 4 s, at 0.005 of critical damping: what rings at its end does not at its start."""
    time, resonance, damping = np.arange(4000) * 1e-3, 2 * np.pi * 8, 0.005
    push = np.exp(-(((time - 2.0) / 0.02) ** 2))
    found = sprung(push, resonance, 1e-3, damping)
    amplitude = np.sqrt(found**2 + (np.gradient(found, 1e-3) / resonance) ** 2)
    ringing = amplitude[(time > 2.2) & (time < 3.9)]
    assert np.abs(found[time < 1.8]).max() < 2e-3 * ringing.max()
    assert ringing[-1] / ringing[0] == pytest.approx(np.exp(-damping * resonance * 1.7), rel=0.02)


@pytest.mark.parametrize("seed", [21, 31])
def test_a_resonance_that_rows_do_not_tell_is_as_uncertain_as_the_share_of_the_inertia(
    machine: Make, seed: int
) -> None:
    """77 Hz, of which rows see the compliance. Behind the spring is anything between no inertia and all of it."""
    made = machine(compliance=1 / (20.0 * (2 * np.pi * 60.0) ** 2), noise=0.4, repeats=1, strokes=24, duration=16.0)
    findings = diagnose_axis([made.drive(seed)], [made.drive(seed + 1)], seed=1)
    compliance, std = _value(findings, "elasticity")
    resonance, unsure = _value(findings, "elasticity", 1)
    assert abs(compliance - 0.6**2 * made.compliance) < 2 * std
    assert 0.1 * resonance < unsure < 0.5 * resonance
    assert abs(resonance - 2 * np.pi * 60.0 / math.sqrt(0.6)) < 2 * unsure


def test_a_delay_of_two_samples_is_named_with_its_length(machine: Make) -> None:
    findings = _diagnosed(machine(delay=0.002))
    assert [str(cause.candidate.effect) for cause in findings.causes] == ["time_delay"]
    assert _value(findings, "time_delay")[0] == pytest.approx(0.002, rel=0.02)


@pytest.mark.parametrize("read", [0.0, 0.5, 0.9])
def test_a_delay_is_as_long_as_it_is_by_the_parameters_fitted_beside_it(machine: Make, read: float) -> None:
    """By those of a first estimate it was short by fourteen standard deviations; holding and reading are part of it."""
    findings = _diagnosed(machine(delay=0.004, read=read, substeps=10, viscous=400.0, coulomb=40.0))
    value, std = _value(findings, "time_delay")
    assert abs(value - 0.004 - (0.5 - read) * 1e-3) < 3 * std


@pytest.mark.parametrize("resonance", [20.0, 30.0, 40.0])
def test_a_compliance_is_what_it_is_near_the_resonance_of_its_load(machine: Make, resonance: float) -> None:
    """All inertia behind it: c = share² over (2π f)² of the mass. By its first term it was a quarter too large."""
    compliance = 1 / (20.0 * (2 * np.pi * resonance) ** 2)
    findings = _diagnosed(machine(compliance=compliance, noise=0.1))
    value, _ = _value(findings, "elasticity")
    assert value == pytest.approx(0.6**2 * compliance, rel=0.08)


def test_bristles_that_break_away_are_named_stribeck(machine: Make) -> None:
    """LuGre friction: at steady speeds 4 N more near rest, gone at 0.02 m/s."""
    findings = _diagnosed(machine(bristle=1e5, breakaway=4.0))
    assert findings.verdict is Verdict.EFFECT
    assert findings.causes[0].candidate.effect == "stribeck"
    assert _value(findings, "stribeck")[0] == pytest.approx(4.0, abs=1.5)
    assert _value(findings, "stribeck", 1)[0] == pytest.approx(0.02, rel=0.3)


def test_a_second_mass_on_a_spring_is_named_elasticity(machine: Make) -> None:
    findings = _diagnosed(machine(compliance=5e-6))
    assert findings.causes[0].candidate.effect == "elasticity"


def test_a_resonance_that_no_candidate_describes_is_not_taken_for_noise(machine: Make) -> None:
    """The same spring, so soft that it rings within the bandwidth of the rows."""
    assert _diagnosed(machine(compliance=2e-5)).verdict is not Verdict.NONE


def test_friction_that_follows_another_axis_is_named(machine: Make) -> None:
    findings = _diagnosed(machine(follower=(15.0, 3.0)))
    assert findings.causes[0].candidate.key == "coupled_friction@axis_1<2"
    assert _value(findings, "coupled_friction")[0] == pytest.approx(15.0, rel=0.02)
    assert _value(findings, "coupled_friction", 1)[0] == pytest.approx(3.0, rel=0.02)


def test_of_two_axes_the_late_one_alone_is_asked_again(machine: Make) -> None:
    stages: list[str] = []
    made = machine(follower=(15.0, 3.0), delay=0.002)
    findings = diagnose_axis([made.drive(11)], [made.drive(12)], seed=1, stage=stages.append)
    words = [stage.split()[0] for stage in stages]
    # Both, then one.
    assert [words[: words.index("again,")].count("comparing"), words.count("comparing")] == [2, 3]
    assert {cause.candidate.key for cause in findings.causes} == {"time_delay@axis_1", "coupled_friction@axis_1<2"}


def _beside_another_joint(machine: Machine, seed: int, start: float) -> AxisRecord:
    """A record of a motion without repeats, under the load of a joint that is not in it."""
    record = machine.drive(seed)
    (axis,) = record.axes
    load = 3.0 * np.sin(0.4 * (start + np.arange(len(axis.effort)) * record.sample_time))
    return replace(record, axes=(replace(axis, effort=axis.effort + load),))


def test_within_one_record_a_force_over_time_may_be_one_over_a_joint_that_is_not_recorded(machine: Make) -> None:
    made = machine(repeats=1, duration=20.0, strokes=32)
    record = _beside_another_joint(made, 11, 0.0)
    findings = diagnose_axis([record], [], seed=1)
    (law,) = findings.diagnosis().effects
    assert law.law is not None
    assert law.law.variable == "time"
    assert [other.variable for other in law.alternatives] == ["other_axis"]
    assert "or on another axis that is not recorded" in headline(findings.diagnosis())
    assert "what else moves" in next_text(findings.diagnosis())


def test_a_force_over_time_that_another_motion_confirms_is_one_over_time(machine: Make) -> None:
    made = machine(repeats=1, duration=20.0, strokes=32)
    findings = diagnose_axis([_beside_another_joint(made, 11, 0.0)], [_beside_another_joint(made, 12, 0.0)], seed=1)
    (law,) = findings.diagnosis().effects
    assert law.law is not None
    assert law.law.variable == "time"
    assert not law.alternatives


def test_what_no_cause_explains_is_not_what_sampling_does(machine: Make) -> None:
    """A force that wanders by itself: a first estimate of the lag is many samples, sampling explains a part of one."""
    record = machine(repeats=1, duration=20.0, strokes=32, speeds=(0.01, 0.02)).drive(11)
    (axis,) = record.axes
    wanders = zero_phase(np.random.default_rng(5).normal(size=len(axis.effort)), 3.0, record.sample_time)
    effort = axis.effort + 20.0 * wanders / wanders.std()
    record = replace(record, axes=(replace(axis, effort=effort),))
    (scale,) = axis_reference([record]).scales
    findings = diagnose_axis([record], [], seed=1)
    found = dict(zip(findings.problem.names, findings.after.baseline.tolist(), strict=True))
    assert abs(scale.late) > 5 * record.sample_time
    assert abs(scale.hold + found["lag"]) < 1


class _Answered:
    """Answers of one axis, as likely as they are."""

    def __init__(self, log_posterior: float) -> None:
        self._said = SimpleNamespace(log_posterior=log_posterior)

    def of(self, parameter: str) -> SimpleNamespace:
        assert parameter == "M"
        return self._said


@pytest.mark.parametrize(("lag", "delay", "kept"), [(0.0, 1.0, "delay"), (10.0, 1.0, "delay"), (30.0, 1.0, "lag")])
def test_the_likelier_of_lag_and_delay_stands_the_noise_of_an_acceleration_apart(
    machine: Make, lag: float, delay: float, kept: str
) -> None:
    """Log odds of 20 that noise may bring are taken off the lag, as they were off the delay."""
    record = machine().drive(11)
    reference = replace(axis_reference([record]), noises=(20.0,))
    late = [replace(scale, delayed=True) for scale in reference.scales]
    (scale,) = likelier_scales(_Answered(lag), _Answered(delay), record.axes, reference, late)
    assert scale.delayed == (kept == "delay")


def test_repeats_are_found_where_the_record_does_not_number_them(machine: Make) -> None:
    record = machine().drive(11)
    unnumbered = replace(record, period=np.full(len(record), -1))
    found = with_repeats(unnumbered)
    assert np.mean(found == record.period) > 0.99


def test_one_record_without_repeats_is_confirmed_by_its_later_part(machine: Make) -> None:
    record = machine(asymmetry=8.0, repeats=1, duration=16.0).drive(3)
    findings = diagnose_axis([record], [], seed=1)
    assert findings.causes[0].candidate.effect == "asymmetric_viscous"


def test_other_rates_and_units_change_nothing(machine: Make) -> None:
    findings = _diagnosed(machine(asymmetry=8.0, rate=250.0, substeps=16))
    assert findings.causes[0].candidate.effect == "asymmetric_viscous"


def test_a_slow_noisy_record_names_nothing_that_the_baseline_absorbs(machine: Make) -> None:
    record = machine(asymmetry=8.0, rate=100.0, substeps=40, repeats=1, duration=30.0, noise=2.0, encoder=1e-5).drive(
        11
    )
    findings = diagnose_axis([record], [], seed=1)
    assert [str(cause.candidate.effect) for cause in findings.causes] == ["asymmetric_viscous"]
    assert {"payload", "torque_gain", "torque_bias"} <= set(findings.invisible)


def _changed(record: AxisRecord, **series: Any) -> AxisRecord:
    return replace(record, axes=tuple(replace(axis, **series) for axis in record.axes))


def test_an_axis_at_rest_is_refused(machine: Make) -> None:
    record = machine().drive(1)
    still = _changed(record, position=np.zeros(len(record)))
    with pytest.raises(EstimationError, match="does not move"):
        diagnose_axis([still], [], seed=1)


def test_an_axis_at_rest_under_a_noisy_encoder_is_refused_as_one_at_rest(machine: Make) -> None:
    record = machine().drive(1)
    still = _changed(record, position=1e-6 * np.random.default_rng(5).normal(size=len(record)))
    with pytest.raises(EstimationError, match="does not move"):
        diagnose_axis([still], [], seed=1)


def test_an_axis_without_any_effort_is_refused(machine: Make) -> None:
    record = machine().drive(1)
    with pytest.raises(EstimationError, match=r"effort of .* never changes"):
        diagnose_axis([_changed(record, effort=np.zeros(len(record)))], [], seed=1)


def test_records_of_different_axes_are_refused(machine: Make) -> None:
    with pytest.raises(RecordError, match="does not have the axes"):
        diagnose_axis([machine().drive(1)], [machine(follower=(1.0, 1.0)).drive(2)], seed=1)


def test_a_delay_by_the_spectrum_is_a_shift_in_time() -> None:
    time = np.arange(2000) * 1e-3
    series = np.sin(2 * np.pi * 3 * time) * np.hanning(2000)
    shifted = np.sin(2 * np.pi * 3 * (time - 0.0004)) * np.interp(time - 0.0004, time, np.hanning(2000))
    np.testing.assert_allclose(delayed(series, 0.0004, 1e-3)[50:-50], shifted[50:-50], atol=1e-5)


def test_derivatives_lose_nothing_in_the_band_of_the_rows() -> None:
    """At ω T = 0.5 the gain is right to 2 parts in 10⁴, where plain central differences lose 4 %."""
    time = np.arange(400) * 0.01
    found = differentiate(np.sin(50 * time), 0.01, SEVEN)
    np.testing.assert_allclose(found[5:-5], 50 * np.cos(50 * time)[5:-5], atol=50 * 2e-4)


def test_a_play_is_crossed_after_every_reversal_and_only_then() -> None:
    position = np.concatenate([np.linspace(0, 1, 101), np.linspace(1, 0, 101)[1:]])
    inside = in_gap(position, 0.2)
    assert not inside[25:101].any()
    assert inside[102:118].all()
    assert not inside[122:].any()


def test_an_axis_that_rests_at_a_side_of_its_play_is_not_crossing_it() -> None:
    """A position that is smoothed rings a little there."""
    rests = 1 + 1e-6 * np.sin(np.arange(200.0))
    assert not in_gap(np.concatenate([np.linspace(0, 1, 101), rests]), 0.2)[25:].any()


EMPS = os.environ.get("QUASIOMNI_EMPS", "")
needs_emps = pytest.mark.skipif(
    not EMPS, reason="QUASIOMNI_EMPS does not name DATA_EMPS.mat, which is not ours to ship"
)


@pytest.fixture(scope="module")
def emps() -> Findings:
    return diagnose_axis([read_axis_record(Path(EMPS))], [], seed=1)


@needs_emps
def test_on_the_real_axis_a_friction_over_the_rate_is_first_and_an_effort_that_is_late_next(emps: Findings) -> None:
    """Laws, each ahead of the names that came first by least squares: of directions that differ, and of a delay."""
    assert emps.verdict is Verdict.LAW
    first, second = (effect.law for effect in emps.diagnosis().effects)
    assert first is not None
    assert second is not None
    assert (first.variable, first.nearest) == ("rate", "asymmetric_viscous@axis")
    assert (second.variable, second.nearest) == ("load_rate", "torque_filter@axis")
    for cause, name in zip(emps.causes, ("asymmetric_viscous", "time_delay"), strict=True):
        assert f"{name}@axis" in list(cause.ranked.log_odds)[:3]
    assert emps.causes[0].closed > 0.4


@needs_emps
def test_what_the_real_axis_repeats_beyond_its_causes_is_said(emps: Findings) -> None:
    assert emps.lacking
    assert "the rest has no name" in " ".join(summary_lines(emps, emps.diagnosis()))


@needs_emps
def test_on_the_real_axis_the_search_stops_when_the_held_out_part_stops_improving(emps: Findings) -> None:
    assert len(emps.causes) <= 3
    assert all(cause.closed >= 0.01 for cause in emps.causes)
    assert emps.gap.after < 0.6 * emps.gap.before
