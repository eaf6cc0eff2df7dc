"""One campaign at a time in a folder, and no trace of it that anybody would have to clear away."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hil.campaign.lock import LOCK_FILE, driving, refuse_driven
from ident.errors import CampaignError

HOLDER = """
import sys
from pathlib import Path
from hil.campaign.lock import driving
from ident.errors import CampaignError
try:
    with driving(Path(sys.argv[1])):
        print("mine", flush=True)
        sys.stdin.read()
except CampaignError as error:
    print(error.what, flush=True)
"""


def holder(folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


def test_the_second_is_refused_and_told_who_the_first_is(tmp_path: Path) -> None:
    folder = tmp_path / "runs" / "mine"
    with holder(folder) as first:
        assert first.stdout.readline() == "mine\n"
        for refused in (refuse_driven, lambda path: driving(path).__enter__()):
            with pytest.raises(CampaignError, match=f"is being driven by process {first.pid} on ") as caught:
                refused(folder)
            assert "--out" in caught.value.remedy
        first.stdin.close()
    refuse_driven(folder)
    assert not folder.exists(), "nothing was put into it"


def test_the_lock_of_a_killed_process_is_none(tmp_path: Path) -> None:
    with holder(tmp_path) as first:
        assert first.stdout.readline() == "mine\n"
        os.kill(first.pid, signal.SIGKILL)
    assert (tmp_path / LOCK_FILE).is_file()
    refuse_driven(tmp_path)
    with driving(tmp_path):
        assert str(os.getpid()) in (tmp_path / LOCK_FILE).read_text()
    assert list(tmp_path.iterdir()) == []


def test_what_was_put_into_the_folder_stays(tmp_path: Path) -> None:
    with driving(tmp_path / "run"):
        (tmp_path / "run" / "run.json").write_text("{}")
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["run.json"]


def test_of_many_at_once_one_drives(tmp_path: Path) -> None:
    """The file comes and goes with each of them, and still no two are inside."""
    folder = tmp_path / "run"
    crowd = [holder(folder) for _ in range(6)]
    said = [one.stdout.readline() for one in crowd]
    assert said.count("mine\n") == 1
    for one in crowd:
        one.stdin.close()
        one.wait()
        one.stdout.close()


def test_a_link_in_place_of_the_lock_is_not_written_through(tmp_path: Path) -> None:
    (tmp_path / "note.txt").write_text("mine")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / LOCK_FILE).symlink_to(tmp_path / "note.txt")
    with pytest.raises(CampaignError, match="cannot be made a run folder"), driving(tmp_path / "run"):
        pass
    assert (tmp_path / "note.txt").read_text() == "mine"


def test_a_file_where_the_folder_should_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / "note.txt").write_text("mine")
    with pytest.raises(CampaignError, match="--out"), driving(tmp_path / "note.txt"):
        pass
    assert (tmp_path / "note.txt").read_text() == "mine"
