"""What is said of records of a vehicle made without any formula of the model, sound and corrupted."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from ident.faults import Fault, find_faults
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription

Drives = Callable[..., tuple[Record, Record]]
Answers = dict[Any, tuple[Fault, ...]]

EVERY = 4
"""Of the corruptions, one in so many is tried by default; all of them by the slow test."""


@pytest.fixture(scope="module")
def sound(drives: Drives) -> Record:
    return drives()[0]


@pytest.fixture(scope="module")
def answers(sound: Record, prototype: VehicleDescription, corruptions: Sequence[Any]) -> Answers:
    return {each: find_faults(each.apply(sound), prototype) for each in corruptions[::EVERY]}


def misnamed(answers: Answers) -> list[str]:
    """Corruptions whose surest fault has neither the name and channel of what was done nor it in its set."""
    return [
        f"{corruption}: {[(str(fault.name), fault.channel, fault.step, fault.also) for fault in faults]}"
        for corruption, faults in answers.items()
        if not faults or f"{corruption.name}@{corruption.channel}" not in names_of(faults[0])
    ]


def names_of(fault: Fault) -> set[str]:
    """All names of its set, without steps."""
    return {f"{fault.name}@{fault.channel}", *(other.split(" in ")[0] for other in fault.also)}


def test_sound_records_have_no_fault(drives: Drives, prototype: VehicleDescription) -> None:
    for record in drives():
        assert find_faults(record, prototype) == ()


@pytest.mark.slow
@pytest.mark.parametrize("effect", [{"bristles": (0, 4.0, 0.1)}, {"compliance": 1e-3}], ids=["bristles", "soft gear"])
def test_effects_of_the_machine_are_no_faults(
    drives: Drives, prototype: VehicleDescription, effect: dict[str, Any]
) -> None:
    assert find_faults(drives(**effect)[0], prototype) == ()


def test_corruptions_are_named_with_their_channel(answers: Answers) -> None:
    assert len(misnamed(answers)) <= 0.1 * len(answers), misnamed(answers)


@pytest.mark.slow
def test_nine_of_ten_of_all_corruptions_are_named_with_their_channel(
    sound: Record, prototype: VehicleDescription, corruptions: Sequence[Any]
) -> None:
    answers = {each: find_faults(each.apply(sound), prototype) for each in corruptions}
    assert len(answers) >= 40
    assert len(misnamed(answers)) <= 0.1 * len(answers), misnamed(answers)


def test_a_fault_states_its_size(answers: Answers) -> None:
    sized = {each: faults for each, faults in answers.items() if each.name in ("scaled", "unsynchronised")}
    for corruption, faults in sized.items():
        stated = [fault.value for fault in faults if fault.channel == corruption.channel]
        assert stated, corruption
        # Of all torques and of time only the priors tell, which a vehicle is some per cent off.
        assert math.isclose(stated[0], corruption.value, rel_tol=0.1, abs_tol=1e-3), corruption


def test_a_fault_that_is_undone_leaves_a_record_that_fits(answers: Answers) -> None:
    undone = [faults[0] for each, faults in answers.items() if each.name in ("channel_swapped", "sign_flipped")]
    assert undone
    assert all(fault.undo_fits and fault.sure for fault in undone)


def test_looking_for_faults_takes_less_than_a_tenth_of_the_recording(
    sound: Record, prototype: VehicleDescription
) -> None:
    begin = time.process_time()
    find_faults(sound, prototype)
    assert time.process_time() - begin < 0.1 * sound.duration
