"""Files that no one would write by mistake: each ends with exit code 2, its name, and the remedy, in a moment."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hil.network import DEFAULT_NETWORK
from ident.vehicle.description import find_data_file

TOO_DEEP = 100_000
CONTENTS: dict[str, bytes] = {
    "lists in lists": b"name = " + b"[" * TOO_DEEP + b"]" * TOO_DEEP,
    "tables in tables": b"name = " + b"{a=" * TOO_DEEP + b"1" + b"}" * TOO_DEEP,
    "a name of many parts": b"[" + b".".join([b"a"] * TOO_DEEP) + b"]",
    "an integer of 5000 digits": b"name = " + b"9" * 5000,
    "an integer of 4000 digits": b"name = " + b"9" * 4000,
    "control characters in a name": b'"limits\\u001b[31m" = 1',
    "control characters in a text": b'name = "\\u0007"',
    "no UTF-8": b'name = "\xe4"',
    "NUL": b"name = 1\x00",
    "nothing": b"",
    "markup": b'"[/red]" = 1\nname = [',
    "too large": b"# " + b"x" * (5 << 20),
}


def assert_refused(answer: Any, name: str) -> None:
    assert answer.code == 2, answer
    assert "Traceback" not in answer.err
    assert name in answer.error
    assert "remedy:" in answer.error
    assert answer.err.replace("\n", "").isprintable()


@pytest.mark.parametrize("content", CONTENTS.values(), ids=CONTENTS)
@pytest.mark.parametrize("option", ["--vehicle", "--network"])
def test_a_file_of_settings_that_cannot_be_is_refused_in_a_moment(
    quasi: Callable[..., Any], tmp_path: Path, option: str, content: bytes
) -> None:
    path = tmp_path / "odd.toml"
    path.write_bytes(content)
    start = time.process_time()
    assert_refused(quasi("can", "load", option, path), "odd.toml")
    assert time.process_time() - start < 5.0


def test_a_byte_order_mark_is_passed_over(quasi: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "marked.toml"
    path.write_bytes(b"\xef\xbb\xbf" + find_data_file("ident.vehicle", "prototype").read_bytes())
    assert quasi("can", "load", "--vehicle", path).code == 0


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e400"])
def test_a_quantity_that_is_no_number_is_named(quasi: Callable[..., Any], tmp_path: Path, number: str) -> None:
    text = find_data_file("ident.vehicle", "prototype").read_text()
    path = tmp_path / "odd.toml"
    path.write_text(text.replace("motor_speed = { value = 314.0", f"motor_speed = {{ value = {number}"))
    answer = quasi("can", "load", "--vehicle", path)
    assert_refused(answer, "odd.toml")
    assert "motor_speed" in answer.error


@pytest.mark.parametrize("eds", ["/dev/zero", "fifo.eds", "folder.eds", "large.eds", "nowhere.eds", "a[/x].eds"])
def test_an_eds_that_is_no_file_of_its_kind_is_named(quasi: Callable[..., Any], tmp_path: Path, eds: str) -> None:
    os.mkfifo(tmp_path / "fifo.eds")
    (tmp_path / "folder.eds").mkdir()
    with (tmp_path / "large.eds").open("wb") as file:
        file.truncate(1 << 40)
    shutil.copyfile(DEFAULT_NETWORK.with_name("encoder.eds"), tmp_path / "encoder.eds")
    path = tmp_path / "network.toml"
    path.write_text(DEFAULT_NETWORK.read_text().replace('"drive.eds"', f'"{eds}"'))
    assert_refused(quasi("can", "load", "--network", path), eds)


@pytest.mark.parametrize("name", ["/dev/zero", "folder.csv", "fifo.csv", "large.blf", "large.csv", "a[/x].csv"])
def test_a_record_that_is_no_file_of_bounded_size_is_named(
    quasi: Callable[..., Any], tmp_path: Path, name: str
) -> None:
    os.mkfifo(tmp_path / "fifo.csv")
    (tmp_path / "folder.csv").mkdir()
    for large in ("large.blf", "large.csv"):
        with (tmp_path / large).open("wb") as file:
            file.truncate(1 << 40)
    (tmp_path / "000_straight.blf").symlink_to(tmp_path / "large.blf")
    path = Path(name) if name.startswith("/") else tmp_path / name.replace("large.blf", "000_straight.blf")
    answer = quasi("identify", path, "--out", tmp_path)
    assert answer.code == 2
    assert "Traceback" not in answer.err
    assert path.name in answer.error or "no logs" in answer.error


def test_brackets_and_escapes_of_a_record_are_text_on_the_terminal(quasi: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "odd.csv"
    header = "time,step,torque_fl,torque_rl,torque_fr,torque_rr,beta_fl,beta_rl,beta_fr,beta_rr,alpha_l,alpha_r\n"
    rows = [f"{k * 0.002},a[/x]\x1b[2J" + ",0" * 10 for k in range(30)]
    path.write_text(header + "\n".join(rows) + "\n")
    answer = quasi("identify", path, "--out", tmp_path)
    assert answer.code == 2
    assert "\x1b[2J" not in answer.err
