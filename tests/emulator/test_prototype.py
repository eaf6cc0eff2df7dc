"""A prototype file describes a vehicle that can be, or is refused with the remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from emulator.prototype import load_prototype
from ident.errors import DataFileError

SHIPPED = Path(__file__).parents[2] / "emulator" / "data"
TABLE_2 = {
    "C_l": 0.3342,
    "d_vl": 4.4649,
    "d_cl": 12.9458,
    "C_r": 0.4501,
    "d_vr": 2.4820,
    "d_cr": 17.1071,
    "m_ch": 842.0684,
    "C_ch": 286.5955,
    "d_vw": 0.7316,
    "d_cw": 3.9656,
    "B_w": 0.121,
}


def rewrite(folder: Path, old: str, new: str, name: str = "prototype") -> Path:
    text = (SHIPPED / f"{name}.toml").read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    path = folder / "changed.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_the_default_prototype_is_table_2_of_the_paper() -> None:
    truth = load_prototype().truth
    assert {symbol: truth[symbol] for symbol in TABLE_2} == TABLE_2


def test_the_second_prototype_has_another_lever_ratio_and_other_directions() -> None:
    first, second = load_prototype("prototype"), load_prototype("compact")
    assert first.geometry.lever_ratio == pytest.approx(1.2)
    assert second.geometry.lever_ratio == pytest.approx(0.64)
    assert first.drive.directions == (1, 1, -1, -1)
    assert second.drive.directions == (-1, -1, 1, 1)
    assert second.encoder.directions == (-1, 1)


def test_a_path_is_read_as_well_as_a_name() -> None:
    by_path = load_prototype(SHIPPED / "compact.toml")
    assert by_path.name == "compact"
    assert by_path.rigid_bodies == load_prototype("compact").rigid_bodies


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("wheel_offset = { value = 0.12", "wheel_offset = { value = -0.12", "wheel_offset"),
        ("wheel_radius = { value = 0.10", "wheel_radius = { value = 0.0", "wheel_radius"),
        ("wheel_offset = { value = 0.12", "wheel_offset = { value = 0.9", "wheel_offset"),
        ("wheel_mass = { value = 2.0", "wheel_mass = { value = 260.0", "chassis would weigh"),
        ("B_w = { value = 0.121", "B_w = { value = 0.40", "left knuckle would have the inertias"),
        ("C_ch = { value = 286.5955", "C_ch = { value = 320.0", "chassis would have the inertias"),
        ("d_cw = { value = 3.9656", "d_cw = { value = -3.9656", "truth.d_cw"),
        ("friction = { value = 0.9", "friction = { value = 0.0", "floor.friction"),
        ("direction_fl = { value = 1.0", "direction_fl = { value = 0.5", "direction_fl"),
        ("zero_position = { value = 65536.0", "zero_position = { value = 0.5", "zero_position"),
        ("peak_torque = { value = 3.8", "peak_torque = { value = 1.0", "peak torque"),
        ("torque_sensor = { value = 0.005", "torque_sensor = { value = -0.005", "torque_sensor"),
        ("load_correlation_time = { value = 0.1", "load_correlation_time = { value = 0.0", "load_corr"),
        ('length = { value = 1.75, unit = "m"', 'length = { value = 1750, unit = "mm"', "'mm'"),
        ("[noise]", "[sound]", "[noise]"),
    ],
)
def test_a_vehicle_that_cannot_be_is_refused_by_name(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    with pytest.raises(DataFileError) as caught:
        load_prototype(rewrite(tmp_path, old, new))
    assert complaint in caught.value.what
    assert caught.value.remedy


def test_a_name_that_is_not_shipped_lists_those_that_are() -> None:
    with pytest.raises(DataFileError) as caught:
        load_prototype("limousine")
    assert "compact" in caught.value.remedy
