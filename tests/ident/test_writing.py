"""A file is there whole or not at all."""

from __future__ import annotations

import os
import socket
import stat
from pathlib import Path

import pytest

from ident.errors import UserError
from ident.writing import refuse_inputs, write_by, write_whole


@pytest.mark.parametrize("content", ["µ\n", b"\x00\xff"])
def test_what_is_written_is_read_back_from_folders_made_on_the_way(content: str | bytes, tmp_path: Path) -> None:
    path = tmp_path / "some" / "where" / "file"
    write_whole(content, path)
    assert path.read_bytes() == (content.encode() if isinstance(content, str) else content)
    assert [entry.name for entry in path.parent.iterdir()] == ["file"]


def test_the_name_of_a_folder_is_refused_and_nothing_is_left_behind(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(UserError, match="is a folder"):
        write_whole("text", tmp_path / "taken")
    assert [entry.name for entry in tmp_path.iterdir()] == ["taken"]


def test_a_file_in_the_way_of_a_folder_is_a_user_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("here")
    with pytest.raises(UserError, match="cannot be written"):
        write_whole("text", tmp_path / "file" / "below")
    assert (tmp_path / "file").read_text() == "here"


def test_a_full_disk_leaves_the_old_file_and_nothing_else(small_disk: Path) -> None:
    path = small_disk / "parameters.toml"
    write_whole("what is there", path)
    with pytest.raises(UserError, match="No space left on device") as caught:
        write_whole(bytes(100_000), path)
    assert "free some space" in caught.value.remedy
    assert [entry.name for entry in small_disk.iterdir()] == ["parameters.toml"]
    assert path.read_text() == "what is there"


def test_a_library_that_fails_half_way_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    write_whole("what is there", path)

    def fail(part: Path) -> None:
        assert part.suffix == ".csv"
        part.write_text("half of")
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write_by(fail, path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["record.csv"]
    assert path.read_text() == "what is there"


def test_the_content_is_on_the_disk_before_the_name_and_the_name_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The system calls in their order: without the first the name may come back, after a power failure, empty."""
    seen: list[str] = []
    fsync, replace = os.fsync, Path.replace

    def noted_fsync(descriptor: int) -> None:
        seen.append("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "content")
        fsync(descriptor)

    def noted_replace(part: Path, target: Path) -> Path:
        seen.append("name")
        return replace(part, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(Path, "replace", noted_replace)
    write_whole("text", tmp_path / "file")
    assert seen == ["content", "name", "folder"]


def test_a_link_stays_a_link_and_the_file_behind_it_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "behind").write_text("old")
    (tmp_path / "link").symlink_to("behind")
    write_whole("new", tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "behind").read_text() == "new"


def test_a_pipe_is_written_into_and_no_device_is_ever_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_whole("text", pipe)
    assert os.read(reader, 100) == b"text"
    os.close(reader)
    assert stat.S_ISFIFO(pipe.lstat().st_mode)
    write_whole("text", Path("/dev/null"))
    assert stat.S_ISCHR(os.lstat("/dev/null").st_mode)
    with pytest.raises(UserError, match="/dev/full cannot be written: No space left"):
        write_whole("text", Path("/dev/full"))
    assert stat.S_ISCHR(os.lstat("/dev/full").st_mode)


def test_a_socket_is_no_file_to_replace(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as served:
        served.bind(str(tmp_path / "can0"))
        with pytest.raises(UserError, match="a device or a socket"):
            write_whole("text", tmp_path / "can0")
    assert (tmp_path / "can0").is_socket()


def test_what_a_command_reads_it_does_not_write_over_under_any_name(tmp_path: Path) -> None:
    record = tmp_path / "record.csv"
    record.write_text("mine")
    (tmp_path / "soft").symlink_to(record)
    os.link(record, tmp_path / "hard")
    for name in (record, tmp_path / "soft", tmp_path / "hard", tmp_path / "." / "record.csv"):
        with pytest.raises(UserError, match="is read by this very command"):
            refuse_inputs([None, name], [None, tmp_path / "not there", record])
    refuse_inputs([tmp_path / "other", None], [record])


def test_two_outputs_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="written twice"):
        refuse_inputs([tmp_path / "a", tmp_path / "b" / ".." / "a"], [])
    refuse_inputs([Path("/dev/null"), Path("/dev/null")], [Path("/dev/null")])
