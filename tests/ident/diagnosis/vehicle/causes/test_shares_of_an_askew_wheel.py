"""What dry contacts decide where two sides point to different centres, integrated step by step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from ident.campaign.steps import EXCITATIONS
from ident.diagnosis.problem import Candidate, Variant
from ident.diagnosis.vehicle.causes.askew import (
    MEAN_STD,
    RATE,
    Travelling,
    beyond_creeping,
    sliding_aside,
    with_shares,
)
from ident.plant import kinematics
from ident.plant.modes import Mode
from ident.records.record import Step
from ident.vehicle.geometry import Geometry
from ident.vehicle.quantities import GRAVITY

Array = NDArray[np.float64]

MODES = {Step.STRAIGHT: Mode.STEERED, Step.ROTATION: Mode.ROTATION}
MASS, INERTIA, ADHESION = 842.0, 150.0, 0.8
FASTEST, PERIOD = 0.5, 3.0
DRAGGING = 100.0
STILL = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Drive:
    """What a vehicle that stands askew does.

    Attributes:
        shown, middle: (N,) between left and right, and what it would show in the middle [m/s].
        lost: (N,) power that the contacts take by sliding aside [W].
        speed: (N,) of the wheels [m/s].
        grip: of all contacts on one side, times the angle [N].
    """

    shown: Array
    middle: Array
    lost: Array
    speed: Array
    grip: float

    @property
    def share(self) -> float:
        """Of what it would show in the middle."""
        return float(self.shown @ self.middle / (self.middle @ self.middle))

    def drag(self, *, creeps: bool = False) -> float:
        """What drags over 2 μ N δ: a force, or where contacts creep one that is so large at 1 m/s."""
        rolled = self.speed**2 if creeps else self.speed
        return float(self.lost @ rolled / (rolled @ rolled) / self.grip)


def driven(step: Step, geometry: Geometry, offset: Array, slip: float) -> Drive:
    """A drive of a vehicle whose steering has offsets.

    A rigid body on four contacts that carry μ N across the wheels from a slip of some `slip` [m/s] on, and along them
    the same traction each, so large that its coordinate moves as a sinusoid.
    """
    nominal = np.asarray(EXCITATIONS[step].steering(geometry), dtype=float)
    told = kinematics.constraint_matrix(nominal[None], geometry)[0]
    true = kinematics.constraint_matrix((nominal + offset)[None], geometry)[0]
    coordinate = {Step.STRAIGHT: 0, Step.ROTATION: 2}[step]
    senses = np.sign(told[4:, coordinate])
    inverse = 1 / np.array([MASS, MASS, INERTIA])
    grip = ADHESION * MASS * GRAVITY / 4

    def across(twist: Array) -> Array:
        slips = true[:4, :3] @ twist
        return np.asarray(-grip * slips / np.hypot(slips, slip))

    def traction(time: float, twist: Array) -> float:
        phase = 2 * np.pi / PERIOD
        wanted = FASTEST * (phase * np.cos(phase * time) + 20 * np.sin(phase * time)) - 20 * twist[coordinate]
        free = inverse * (true[:4, :3].T @ across(twist))
        pulled = inverse * (true[4:, :3].T @ senses)
        return float((wanted - free[coordinate]) / pulled[coordinate])

    def rates(time: float, twist: Array) -> Array:
        pull = traction(time, twist) * senses
        return np.asarray(inverse * (true[:4, :3].T @ across(twist) + true[4:, :3].T @ pull))

    found = solve_ivp(rates, (0, 2 * PERIOD), np.zeros(3), method="LSODA", rtol=1e-7, atol=1e-9, max_step=0.01)
    twists = found.y[:, found.t > PERIOD / 10].T
    rolled = np.hstack([np.zeros((len(twists), 4)), -twists @ true[4:, :3].T])
    told_left, true_left = (_left_right(matrix, rolled, senses) for matrix in (told, true))
    middle = told_left - true_left
    lost = -np.einsum("ni,ni->n", [across(twist) for twist in twists], twists @ true[:4, :3].T)
    speed = np.abs(twists @ true[4:, :3].T).mean(axis=1)
    return Drive(told_left, middle, np.asarray(lost), np.asarray(speed), float(2 * grip * np.abs(offset).sum()))


def _left_right(matrix: Array, rolled: Array, senses: Array) -> Array:
    left = rolled - rolled @ np.linalg.pinv(matrix[:, :3]).T @ matrix[:, :3].T
    return np.asarray(left[:, 4:] * senses @ np.array([1, 1, -1, -1]) / 2)


@pytest.mark.parametrize("slip", [1e-5, 1e-4, 1e-2])
@pytest.mark.parametrize("offset", [(5e-3, 0.0), (0.0, 5e-3), (-5e-3, 0.0), (1e-3, 0.0)])
def test_shares_of_driving_straight_and_of_turning_are_one_on_average(
    offset: tuple[float, float], slip: float, geometry: Geometry
) -> None:
    shares = [driven(step, geometry, np.array(offset), slip).share for step in (Step.STRAIGHT, Step.ROTATION)]
    assert np.mean(shares) == pytest.approx(1.0, abs=MEAN_STD)
    assert all(-0.1 < share < 2.1 for share in shares)


def test_a_vehicle_follows_the_side_that_drags_where_contacts_slide_and_takes_the_middle_where_they_creep(
    geometry: Geometry,
) -> None:
    outward, inward = np.array([5e-3, 0.0]), np.array([-5e-3, 0.0])
    assert driven(Step.STRAIGHT, geometry, outward, 1e-5).share > 1.6
    assert driven(Step.STRAIGHT, geometry, inward, 1e-5).share < 0.4
    assert driven(Step.STRAIGHT, geometry, outward, 1e-2).share == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("step", [Step.STRAIGHT, Step.ROTATION])
@pytest.mark.parametrize("offset", [5e-3, -5e-3])
def test_where_contacts_slide_the_share_is_none_or_two_less_the_speed_at_which_they_creep(
    offset: float, step: Step, geometry: Geometry
) -> None:
    drive = driven(step, geometry, np.array([offset, 0.0]), 1e-5)
    columns = np.stack([drive.middle, beyond_creeping(drive.middle, drive.speed / geometry.wheel_radius)], axis=1)
    (share, lacking), *_ = np.linalg.lstsq(columns, drive.shown, rcond=None)
    assert abs(share - 1) == pytest.approx(1.0, abs=0.06)
    assert -lacking * np.sign(share - 1) == pytest.approx(9e-5, rel=0.15)
    alone = drive.shown - drive.share * drive.middle
    assert np.linalg.norm(drive.shown - columns @ [share, lacking]) < 0.45 * np.linalg.norm(alone)


def test_the_direction_of_what_is_shown_begins_where_wheels_are_fast() -> None:
    rate = np.array([0.001, 3.0, 3.0])
    found = beyond_creeping(np.array([1e-6, -3e-3, 3e-3]), rate)
    assert found == pytest.approx([0.005, -1.0, 1.0], abs=1e-3)


def test_wheels_that_slide_aside_drag_by_their_grip_and_the_angle_in_every_drive(geometry: Geometry) -> None:
    for step in (Step.STRAIGHT, Step.ROTATION):
        lost = driven(step, geometry, np.array([5e-3, 0.0]), 1e-5).drag()
        assert lost == pytest.approx(sliding_aside(MODES[step], geometry), rel=0.01)


def test_where_contacts_creep_the_drag_goes_with_the_square_of_how_fast_axes_are_for_it_does_so_with_their_speed(
    geometry: Geometry,
) -> None:
    straight, turning = (
        driven(step, geometry, np.array([5e-3, 0.0]), 1e-2).drag(creeps=True) for step in (Step.STRAIGHT, Step.ROTATION)
    )
    assert turning / straight == pytest.approx(sliding_aside(Mode.ROTATION, geometry) ** 2, rel=0.03)


@pytest.fixture
def shared() -> Candidate:
    """A cause that acts in the rolling rows of two drives, in the travel of one of them and at rest."""
    column = np.array([[1.0], [2.0]])
    variant = Variant((column, column, None, column))
    plain = Candidate("steering_offset", "steering_left", (), (variant,))
    rate, friction = np.array([1.0, 3.0]), np.array([2.0, -2.0])
    blocks = (Travelling(0, None, rate), Travelling(1, None, rate), Travelling(1, friction, rate), None)
    return with_shares(plain, blocks, DRAGGING)


def _form(candidate: Candidate) -> Callable[[Array], list[Array | None]]:
    assert candidate.contribution is not None
    form = candidate.contribution
    return lambda numbers: list(form(numbers, np.zeros(11)))


def test_a_cause_without_shares_is_itself(shared: Candidate) -> None:
    first, second, travel, rest = _form(shared)(np.array([0.5]))
    assert travel is None
    for series in (first, second, rest):
        assert series == pytest.approx([0.5, 1.0])


def test_a_share_belongs_to_the_rolling_rows_of_its_drive_and_a_drag_to_its_travel(shared: Candidate) -> None:
    first, second, travel, rest = _form(shared)(np.array([0.5, 0.25, 1e3, *STILL, 0.8, -0.8, 0.0]))
    assert first == pytest.approx([0.9, 1.8])
    assert second == pytest.approx([0.1, 0.2])
    assert travel == pytest.approx([0.5, -0.5])
    assert rest == pytest.approx([0.5, 1.0])


def test_a_drag_without_a_bend_goes_with_the_rate(shared: Candidate) -> None:
    slow, fast = (abs(float(_form(shared)(np.array([0.0, 0.25, bend, *STILL, *STILL]))[2][0])) for bend in (0.0, 1e3))  # type: ignore[index]
    assert slow == pytest.approx(0.25 * 2.0 / RATE, rel=1e-3)
    assert fast == pytest.approx(0.25 * 2.0)


def test_columns_and_form_of_shares_agree_where_wheels_are_fast(shared: Candidate) -> None:
    wide = shared.variants[-1]
    coefficients = np.array([0.3, 0.2, 0.0, -1e-3, 2e-3, 0.0, 0.1, 0.0])
    assert wide.start is not None
    numbers = wide.start(coefficients)
    for column, series in zip(wide.columns, _form(shared)(numbers), strict=True):
        assert column is not None
        assert series is not None
        assert column @ coefficients == pytest.approx(series, abs=1e-3)


def test_a_drag_is_expected_to_be_that_of_wheels_turned_aside_so_far(shared: Candidate) -> None:
    assert shared.expected is not None
    none, half, whole = (
        float(shared.expected(np.array([0.01, share * DRAGGING * 0.01, 1.0, *STILL, *STILL]))[0])
        for share in (0, 0.5, 1)
    )
    assert (none, half, whole) == pytest.approx((-1.0, 0.0, 1.0))


def test_what_no_row_shows_of_an_offset_stays_nothing(shared: Candidate) -> None:
    blocks = (None, Travelling(0, np.ones(2), np.ones(2)))
    unseen = with_shares(replace(shared, variants=(Variant((None, None)),)), blocks, DRAGGING)
    assert [variant.columns for variant in unseen.variants] == [(None, None)] * 2


def test_a_mean_share_other_than_one_is_unexpected(shared: Candidate) -> None:
    assert shared.expected is not None
    apart, both = (
        shared.expected(np.array([0.5, 0.1, 1.0, *STILL, *above, 0.0])) for above in ((0.9, -0.9), (0.5, 0.5))
    )
    assert apart[-1] == pytest.approx(0.0)
    assert both[-1] == pytest.approx(0.5 / MEAN_STD)
    assert len(shared.expected(np.array([0.5]))) == 0
