"""A file is there whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from ident.errors import UserError
from ident.writing import write_whole


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
