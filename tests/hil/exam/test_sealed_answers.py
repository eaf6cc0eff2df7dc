"""What a sealed exam keeps from whoever has its folder, and what its key opens."""

from __future__ import annotations

import json
import stat
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.exam import sealed, sealing
from hil.exam.answer_file import answer_hash, answer_text, open_answer, open_cases, undriven_text
from hil.exam.cases import Case
from hil.exam.diagnosing import refuse_undiagnosed
from hil.exam.drawing import Composition, draw_cases
from hil.exam.folder import Exam, ExamFolder, read_exam, write_exam
from hil.exam.key import Key, make_key, read_key
from hil.exam.lots import lots_of_key, lots_of_seed
from hil.exam.sealing import VehicleOrder, seal
from hil.exam.sizes import SizeTable
from hil.exam.world import World
from hil.exam.worlds import world_of
from ident.errors import UserError
from ident.writing import write_whole

pytest.importorskip("cryptography")

SALT = bytes(16)
PROTOTYPE = world_of("prototype", None)
FEW = Composition(effects=3, pairs=1, none=2, unknown=1, invisible=1, laws=1, faults=1, excitations=2)


@pytest.fixture
def folder(tmp_path: Path) -> ExamFolder:
    return ExamFolder(tmp_path / "exam")


@pytest.fixture
def key(tmp_path: Path, folder: ExamFolder) -> Key:
    return make_key(tmp_path / "exam.key", folder.path)


def manifest(cases: list[Case], key: Key) -> Exam:
    names = tuple(case.identifier for case in cases)
    return Exam("prototype", "pybullet", 0.002, ("one", "two"), names, None, SALT.hex(), key.fingerprint(SALT))


def written(folder: ExamFolder, cases: list[Case], key: Key) -> Exam:
    exam = manifest(cases, key)
    text = answer_text(cases, exam, key)
    write_whole(text, folder.answer)
    write_exam(folder, replace(exam, answer_hash=answer_hash(text)))
    return read_exam(folder)


def test_a_manifest_survives_being_written(cases: list[Case], folder: ExamFolder, key: Key) -> None:
    exam = manifest(cases, key)
    write_exam(folder, exam)
    assert read_exam(folder) == exam
    assert json.loads(folder.manifest.read_text())["sealed"] is True


def test_a_fresh_key_is_the_owners_alone_and_is_never_overwritten(tmp_path: Path, folder: ExamFolder) -> None:
    path = tmp_path / "keys" / "exam.key"
    first = make_key(path, folder.path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert make_key(path, folder.path) == first == read_key(path, folder.path)
    assert make_key(tmp_path / "another.key", folder.path).secret != first.secret
    assert first.secret.hex() not in repr(first)


def test_a_file_that_is_no_key_is_refused_and_left_alone(tmp_path: Path, folder: ExamFolder) -> None:
    for content in (b"", b"my notes\n", b"quasiomni.exam.key/1 1234\n", b"\xff\n\n"):
        path = tmp_path / "notes.txt"
        path.write_bytes(content)
        with pytest.raises(UserError, match="is no key"):
            make_key(path, folder.path)
        assert path.read_bytes() == content


def test_no_key_lies_in_the_folder_that_is_handed_on(tmp_path: Path, folder: ExamFolder) -> None:
    folder.path.mkdir()
    (tmp_path / "link").symlink_to(folder.path)
    for inside in (folder.path / "exam.key", folder.path / "deep" / "key", tmp_path / "link" / "key"):
        with pytest.raises(UserError, match="lies in the exam's folder"):
            make_key(inside, folder.path)
        assert not inside.exists()


def test_the_answer_opens_with_its_key(cases: list[Case], folder: ExamFolder, key: Key) -> None:
    written(folder, cases, key)
    assert open_cases(folder, key.path) == cases


def test_the_answer_opens_with_no_other_key(cases: list[Case], folder: ExamFolder, key: Key, tmp_path: Path) -> None:
    exam = written(folder, cases, key)
    with pytest.raises(UserError, match="opens with its key alone"):
        open_cases(folder, None)
    other = make_key(tmp_path / "another.key", folder.path)
    with pytest.raises(UserError, match="is not the key of"):
        open_cases(folder, other.path)
    # Even without the fingerprint, nothing opens.
    with pytest.raises(UserError, match="is not the one that"):
        open_answer(folder, exam, other)
    with pytest.raises(UserError, match="cannot be read"):
        open_cases(folder, tmp_path / "lost.key")


def test_an_answer_that_was_changed_is_refused(cases: list[Case], folder: ExamFolder, key: Key) -> None:
    exam = written(folder, cases, key)
    write_whole(answer_text(cases[::-1], exam, key), folder.answer)
    with pytest.raises(UserError, match="not the answer that was sealed"):
        open_cases(folder, key.path)


@pytest.mark.parametrize("change", [{"plans": ["two", "one"]}, {"identifiers": []}, {"cycle": 0.004}, {"engine": "x"}])
def test_a_manifest_that_was_changed_is_refused(
    cases: list[Case], folder: ExamFolder, key: Key, change: dict[str, object]
) -> None:
    written(folder, cases, key)
    folder.manifest.write_text(json.dumps(json.loads(folder.manifest.read_text()) | change))
    with pytest.raises(UserError, match="is not the one that"):
        open_cases(folder, key.path)


def test_nothing_of_the_answer_shows(cases: list[Case], key: Key) -> None:
    exam = manifest(cases, key)
    text = answer_text(cases, exam, key)
    assert not any(word in text for word in ("stribeck", "wheel", "effect", *exam.identifiers))
    assert text != answer_text(cases, exam, key)
    assert "stalls" not in undriven_text("a", "stalls with backlash", exam, key)


def test_the_length_of_the_answer_tells_the_number_of_cases_alone(cases: list[Case], key: Key) -> None:
    exam = manifest(cases, key)
    pair, nothing = (next(case for case in cases if case.kind == kind) for kind in ("pair", "none"))
    assert len(answer_text([pair] * 9, exam, key)) == len(answer_text([nothing] * 9, exam, key))
    reasons = (undriven_text("a", reason, exam, key) for reason in ("", "stalls " * 50))
    assert len({len(text) for text in reasons}) == 1


def test_a_key_draws_other_cases_for_every_exam_and_the_same_for_one(table: SizeTable, key: Key) -> None:
    def drawn(salt: bytes) -> list[Case]:
        lots = lots_of_key(key, salt)
        return draw_cases(table, FEW, lots.noise, lots.questions, lots.identifiers)

    assert drawn(SALT) == drawn(SALT)
    assert not {case.seed for case in drawn(SALT)} & {case.seed for case in drawn(bytes(15) + b"a")}


def test_seeds_of_a_secret_are_too_many_to_be_tried_and_share_no_stream(key: Key) -> None:
    lots = lots_of_key(key, SALT)
    seeds = {*(lots.noise(number) for number in range(50)), *(lots.excitation(number) for number in range(50))}
    assert len(seeds) == 100
    assert np.log2(float(min(seeds))) > 100
    # What is read from the names says nothing of the questions: the generators are not one.
    assert lots.questions.bytes(16) != lots.identifiers.bytes(16)


def test_an_unsealed_set_says_so_and_follows_from_its_seed(
    table: SizeTable, folder: ExamFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    exam = sealed_without_driving(ordered(folder, None, 901), table, monkeypatch)
    assert (exam.sealed, exam.first_seed) == (False, 901)
    assert json.loads(folder.manifest.read_text())["sealed"] is False
    lots = lots_of_seed(901)
    assert open_cases(folder, None) == draw_cases(table, FEW, lots.noise, lots.questions)
    assert "noise_units" in folder.answer.read_text()


def test_sealing_goes_on_with_the_same_key_alone(
    table: SizeTable, folder: ExamFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "exam.key"
    order = ordered(folder, path, None)
    sealed = sealed_without_driving(order, table, monkeypatch)
    answer = folder.answer.read_bytes()
    other_model = tmp_path / "model.toml"
    other_model.write_text(order.model.read_text() + "# Another.\n")
    assert sealed_without_driving(order, table, monkeypatch) == sealed
    for wrong, words in (
        (replace(order, key=None, first_seed=5), "holds a sealed exam"),
        (replace(order, key=make_key(tmp_path / "another.key", folder.path).path), "is not the key of"),
        (replace(order, key=tmp_path / "lost.key"), "cannot be read"),
        (replace(order, composition=replace(FEW, none=1, unknown=2)), "holds another exam"),
        (replace(order, world=world_of("compact", None)), "of prototype in"),
        (replace(order, model=other_model), "is not the model.toml"),
    ):
        with pytest.raises(UserError, match=words):
            sealed_without_driving(wrong, table, monkeypatch)
    assert folder.answer.read_bytes() == answer
    assert not (tmp_path / "lost.key").exists()


def test_neither_and_both_of_key_and_seed_are_refused(table: SizeTable, folder: ExamFolder, tmp_path: Path) -> None:
    for key, seed in ((None, None), (tmp_path / "exam.key", 5)):
        with pytest.raises(UserError, match="either from a secret or from a seed"):
            seal(
                ordered(folder, key, seed),
                table,
                lambda *_: None,
            )
    assert not folder.path.exists()
    assert not (tmp_path / "exam.key").exists()


def test_records_look_alike_from_outside_however_long_they_took(
    table: SizeTable, folder: ExamFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Made one after the other in the order of the names that everybody sees, whatever order they were driven in."""
    order = ordered(folder, tmp_path / "exam.key", None)
    written_names: list[str] = []
    write = sealed.write_whole

    def noted(content: str | bytes, path: Path) -> None:
        if path.parent.name == "cases":
            written_names.append(path.name.partition(".")[0])
        write(content, path)

    monkeypatch.setattr(sealed, "write_whole", noted)
    exam = sealed_without_driving(order, table, monkeypatch)
    stats = [path.stat() for path in (folder.path / "cases").iterdir()]
    assert len(stats) == 2 * FEW.total
    assert {(one.st_mtime, one.st_size) for one in stats} == {(0.0, 4)}
    assert written_names[-2 * FEW.total :] == [name for name in exam.identifiers for _ in range(2)]


def test_candidates_are_left_out_once_all_cases_are_diagnosed(folder: ExamFolder) -> None:
    """Which cases are asked again tells which have one effect."""
    write_whole(b"{}", folder.diagnosis("a"))
    with pytest.raises(UserError, match="1 cases of"):
        refuse_undiagnosed(folder, ["a", "b"])
    write_whole(b"{}", folder.diagnosis("b"))
    refuse_undiagnosed(folder, ["a", "b"])


def ordered(folder: ExamFolder, key: Path | None, first_seed: int | None) -> VehicleOrder:
    return VehicleOrder(folder.path, FEW, key, first_seed, 1, None, PROTOTYPE, PROTOTYPE.model_file)


def sealed_without_driving(order: VehicleOrder, table: SizeTable, monkeypatch: pytest.MonkeyPatch) -> Exam:
    """Seals with excitations and records that nobody waits for."""

    def plans(number: int, *_: object) -> tuple[int, str]:
        return number, f"plan {number}"

    def driven(_plans: str, _world: World, _cycle: float, case: Case) -> tuple[str, tuple[bytes, bytes]]:
        return case.identifier, (b"some", b"more")

    monkeypatch.setattr(sealing, "draw_plans", plans)
    monkeypatch.setattr(sealing, "drive_case", driven)
    return seal(order, table, lambda *_: None)
