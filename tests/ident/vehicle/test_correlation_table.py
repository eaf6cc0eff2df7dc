"""The table `[correlation]` of a parameter file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ident.effects.extended import ExtendedModel
from ident.errors import DataFileError
from ident.parameters_file import model_text, read_model
from ident.vehicle.parameters import PARAMETER_NAMES, Parameters

COUNT = len(PARAMETER_NAMES)


def _model(correlation: np.ndarray | None) -> ExtendedModel:
    return ExtendedModel(Parameters(np.arange(1.0, COUNT + 1), np.full(COUNT, 0.01), correlation))


def _drawn(seed: int) -> np.ndarray:
    loadings = np.random.default_rng(seed).normal(size=(COUNT, COUNT + 3))
    covariance = loadings @ loadings.T
    scale = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(scale, scale))


def _written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("seed", range(3))
def test_what_is_written_is_read_again(tmp_path: Path, seed: int) -> None:
    file = _written(tmp_path / "model.toml", model_text(_model(_drawn(seed)), {"run": "a run"}))
    read = read_model(file).parameters.correlation
    assert read is not None
    np.testing.assert_allclose(read, _drawn(seed), atol=1e-6)


def test_a_file_that_states_none_says_so(tmp_path: Path) -> None:
    text = model_text(_model(None), {"run": "a run"})
    assert "correlation" not in text
    assert read_model(_written(tmp_path / "model.toml", text)).parameters.correlation is None


def test_values_that_are_replaced_keep_what_their_errors_have_in_common() -> None:
    model = _model(_drawn(0)).parameters
    assert model.replaced(m_ch=900.0).correlation is model.correlation


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ('"C_l", "d_vl"', '"d_vl", "C_l"', "does not name the parameters"),
        ("[1.000000,", "[2.000000,", "not that of a correlation"),
        ("[1.000000,", "[nan,", "11 by 11 numbers"),
        ("[1.000000,", "[", "11 by 11 numbers"),
    ],
)
def test_a_table_that_cannot_be_used_is_refused_with_the_remedy(
    tmp_path: Path, before: str, after: str, says: str
) -> None:
    text = model_text(_model(np.eye(COUNT)), {"run": "a run"})
    assert before in text
    with pytest.raises(DataFileError, match=rf"(?s)model\.toml.*{says}.*leave \[correlation\] out"):
        read_model(_written(tmp_path / "model.toml", text.replace(before, after, 1)))


def test_errors_that_contradict_each_other_are_no_correlation(tmp_path: Path) -> None:
    """Two that go with a third, and against each other."""
    matrix = np.eye(COUNT)
    for (one, other), value in {(0, 1): 0.9, (0, 2): 0.9, (1, 2): -0.9}.items():
        matrix[one, other] = matrix[other, one] = value
    with pytest.raises(DataFileError, match="not that of a correlation"):
        read_model(_written(tmp_path / "model.toml", model_text(_model(matrix), {"run": "a run"})))
