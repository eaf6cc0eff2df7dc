"""The table `[sampling]` of a parameter file."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from ident.errors import DataFileError
from ident.vehicle.lag import Lag, lag_text, read_lag

FILE = Path("parameters.toml")
LAG = Lag(value=-2.5e-4, std=9e-5, interval=0.002)


def test_what_is_written_is_read_again() -> None:
    assert read_lag(tomllib.loads(lag_text(LAG, "a run")), FILE) == LAG


def test_files_from_before_say_nothing_of_it() -> None:
    assert read_lag({"parameters": {}}, FILE) is None


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ('unit = "s"', 'unit = "ms"', "sampling.lag.*Give it in 's'"),
        ("[sampling.interval]", "[sampling.intervall]", "intervall.*Did you mean 'interval'"),
        ("value = -0.00025", "value = nan", "sampling.lag"),
        ("std = 9e-05", "std = 0.0", "sampling.lag has no standard deviation"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_by_name(before: str, after: str, says: str) -> None:
    text = lag_text(LAG, "a run")
    assert before in text
    with pytest.raises(DataFileError, match=says):
        read_lag(tomllib.loads(text.replace(before, after, 1)), FILE)
