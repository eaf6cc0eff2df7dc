"""Forces, friction and rolling in every engine, against formulas written down here."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from emulator.as_built import AsBuilt
from emulator.engine.protocol import Engine, MakeEngine
from emulator.prototype import Prototype, load_prototype
from ident.vehicle.quantities import GRAVITY

STEP = 1e-3
STEERING, ROLLING = slice(0, 4), slice(4, 8)


@pytest.fixture(params=["prototype", "compact"])
def prototype(request: pytest.FixtureRequest) -> Prototype:
    return load_prototype(request.param)


@pytest.fixture
def engine(prototype: Prototype, make_engine: MakeEngine) -> Iterator[Engine]:
    engine = make_engine(AsBuilt.of(prototype), step_size=STEP, gui=False)
    run(engine, [0.0] * 8, 0.5)
    yield engine
    engine.close()


def run(engine: Engine, torques: list[float], duration: float) -> None:
    for _ in range(round(duration / STEP)):
        engine.step(torques)


def loads(engine: Engine) -> list[float]:
    """Normal force on each wheel [N]."""
    return [normal for normal, _ in engine.floor_forces()]


def test_the_four_wheels_share_the_weight(engine: Engine, prototype: Prototype) -> None:
    quarter = prototype.truth["m_ch"] * GRAVITY / 4
    assert loads(engine) == pytest.approx([quarter] * 4, rel=1e-4)


def test_acceleration_moves_load_to_the_rear_axle(engine: Engine, prototype: Prototype) -> None:
    """Moments about the pitch axis: the contact forces' lever, less what accelerating wheels take by spinning."""
    p, g = prototype.truth, prototype.geometry
    torque = 25.0
    run(engine, [0.0] * 4 + [torque] * 4, 0.4)
    speed = engine.base_velocity()[0][0]
    run(engine, [0.0] * 4 + [torque] * 4, STEP)
    acceleration = (engine.base_velocity()[0][0] - speed) / STEP
    centre = prototype.body.centre_height - p["m_ch"] * GRAVITY / 4 / prototype.tyre.stiffness
    units = 4 * (prototype.rigid_bodies.wheel.mass + prototype.rigid_bodies.knuckles[0].mass)
    mean_height = centre - units / p["m_ch"] * (prototype.body.centre_height - g.wheel_radius)
    moment = p["m_ch"] * acceleration * mean_height + 4 * p["B_w"] * acceleration / g.wheel_radius
    moved = moment / g.wheelbase / 2
    now, quarter = loads(engine), p["m_ch"] * GRAVITY / 4
    for load, sign in zip(now, (-1, 1, -1, 1), strict=True):
        assert load - quarter == pytest.approx(sign * moved, rel=0.01)


def test_driving_straight_balances_force_and_energy(engine: Engine, prototype: Prototype) -> None:
    p, r = prototype.truth, prototype.geometry.wheel_radius
    torque = 3 * p["d_cw"]
    run(engine, [0.0] * 4 + [torque] * 4, 1.0)
    distance, speed = engine.base_pose()[0][0], engine.base_velocity()[0][0]
    mass = p["m_ch"] + 4 * p["B_w"] / r**2
    force = 4 * (torque - p["d_cw"]) / r
    assert speed == pytest.approx(force / mass * 1.0, rel=1e-4)
    energy = 0.5 * mass * speed**2
    assert energy == pytest.approx(force * distance, rel=2e-3)


def test_wheels_roll_without_slip_on_a_curve(prototype: Prototype, make_engine: MakeEngine) -> None:
    """Every wheel's rolling speed is the speed of its axle over the floor, along its heading."""
    g = prototype.geometry
    curvature = 0.4
    left, right = (math.atan(g.wheelbase / 2 * curvature / (1 - s * curvature * g.track_width / 2)) for s in (1, -1))
    engine = make_engine(AsBuilt.of(prototype), step_size=STEP, gui=False)
    engine.place(on_stand=False, angles=[left, -left, right, -right, 0, 0, 0, 0])
    run(engine, [0.0] * 8, 0.5)
    run(engine, [0.0] * 4 + [3 * prototype.truth["d_cw"]] * 4, 0.5)
    (vx, vy, _), (_, _, yaw_rate) = engine.base_velocity()
    heading = 2 * math.asin(engine.base_pose()[1][2])
    forward = math.cos(heading) * vx + math.sin(heading) * vy
    assert yaw_rate == pytest.approx(curvature * forward, rel=1e-3)
    signs = [(1, 1), (-1, 1), (1, -1), (-1, -1)]
    for (end, side), delta, rate in zip(signs, engine.angles()[STEERING], engine.mean_rates()[ROLLING], strict=True):
        x = end * g.wheelbase / 2 - side * g.wheel_offset * math.sin(delta)
        y = side * g.track_width / 2 + side * g.wheel_offset * math.cos(delta)
        along = (forward - yaw_rate * y) * math.cos(delta) + yaw_rate * x * math.sin(delta)
        assert rate * g.wheel_radius == pytest.approx(along, abs=1e-3 * forward)
    engine.close()


def test_a_wheel_sticks_under_less_than_its_coulomb_torque(engine: Engine, prototype: Prototype) -> None:
    before = engine.base_pose()[0]
    run(engine, [0.0] * 4 + [0.98 * prototype.truth["d_cw"]] * 4, 1.0)
    assert math.dist(before[:2], engine.base_pose()[0][:2]) < 1e-6
    run(engine, [0.0] * 4 + [1.05 * prototype.truth["d_cw"]] * 4, 1.0)
    assert engine.base_pose()[0][0] > 1e-3


@pytest.mark.parametrize(("side", "symbol"), [(0, "d_cl"), (1, "d_cr")])
def test_a_steering_side_sticks_until_its_own_and_its_wheels_friction_break(
    engine: Engine, prototype: Prototype, side: int, symbol: str
) -> None:
    """Breakaway of the wheel torques M_rear = -M_front: 2 (a/r) M = d_c + 2 (a/r) d_cw."""
    p, rho = prototype.truth, prototype.geometry.lever_ratio
    breakaway = (p[symbol] + 2 * rho * p["d_cw"]) / (2 * rho)
    signs = [-1.0, 1.0, 0.0, 0.0] if side == 0 else [0.0, 0.0, 1.0, -1.0]
    for share, moves in ((0.99, False), (1.05, True)):
        start = engine.steering_angle(side)
        run(engine, [0.0] * 4 + [share * breakaway * sign for sign in signs], 0.3)
        assert (engine.steering_angle(side) - start > 1e-3) is moves


def test_the_rear_wheel_of_a_side_turns_against_the_front(engine: Engine, prototype: Prototype) -> None:
    torque = 3 * (prototype.truth["d_cl"] + prototype.truth["d_cw"])
    run(engine, [0.0] * 4 + [-torque, torque, 0.0, 0.0], 0.1)
    front, rear = engine.angles()[:2]
    assert front > 0.1
    assert rear == pytest.approx(-front, abs=1e-4)


def test_the_steering_stops_hold_against_full_torque(engine: Engine, prototype: Prototype) -> None:
    limit = prototype.geometry.steering_limit
    for sign in (1.0, -1.0):
        run(engine, [0.0] * 4 + [-60.0 * sign, 60.0 * sign, 0.0, 0.0], 0.6)
        assert engine.steering_angle(0) == pytest.approx(sign * limit, abs=5e-3)


def test_rates_now_are_second_order_and_mean_rates_half_a_step_old(
    prototype: Prototype, make_engine: MakeEngine
) -> None:
    """Under constant torque speed grows linearly: the mean over a step lags half a step, the estimate none."""
    p = prototype.truth
    engine = make_engine(AsBuilt.of(prototype), step_size=STEP, gui=False)
    engine.place(on_stand=True, angles=[0.0] * 8)
    torque, steps = 3 * p["d_cw"], 200
    run(engine, [0.0] * 4 + [torque] * 4, steps * STEP)
    acceleration = (torque - p["d_cw"]) / p["B_w"]
    # Leapfrog starts from rest half a step before the first force.
    assert engine.mean_rates()[4] == pytest.approx(acceleration * steps * STEP, rel=1e-9)
    assert engine.rates()[4] == pytest.approx(acceleration * (steps + 0.5) * STEP, rel=1e-9)
    engine.close()


def test_on_the_stand_nothing_moves_but_the_wheel_that_is_driven(engine: Engine) -> None:
    engine.place(on_stand=True, angles=[0.1, -0.1, 0.2, -0.2, 0, 0, 0, 0])
    run(engine, [0.0] * 4 + [10.0, 0.0, 0.0, 0.0], 0.5)
    angles = engine.angles()
    assert angles[:4] == pytest.approx([0.1, -0.1, 0.2, -0.2], abs=1e-9)
    assert angles[4] > 1.0
    assert angles[5:] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert engine.base_pose()[0][:2] == pytest.approx((0.0, 0.0), abs=1e-12)
    assert loads(engine) == [0.0] * 4


def test_two_engines_do_not_share_a_world(prototype: Prototype, make_engine: MakeEngine) -> None:
    first, second = (make_engine(AsBuilt.of(prototype), step_size=STEP, gui=False) for _ in range(2))
    run(first, [0.0] * 4 + [10.0] * 4, 0.2)
    assert first.base_velocity()[0][0] > 0.01
    assert second.base_velocity()[0][0] == 0.0
    first.close()
    run(second, [0.0] * 8, 0.01)
    second.close()


def test_what_is_held_at_half_its_dry_friction_creeps_less_than_a_milliradian_a_minute(
    engine: Engine, prototype: Prototype
) -> None:
    """Steering of a side on the floor, then wheels in the air."""
    p, rho = prototype.truth, prototype.geometry.lever_ratio
    half = 0.5 * (p["d_cl"] + 2 * rho * p["d_cw"]) / (2 * rho)
    run(engine, [0.0] * 4 + [-half, half, 0.0, 0.0], 1.0)
    start = engine.angles()
    run(engine, [0.0] * 4 + [-half, half, 0.0, 0.0], 6.0)
    assert engine.angles() == pytest.approx(start, abs=1e-4)
    engine.place(on_stand=True, angles=[0.0] * 8)
    run(engine, [0.0] * 4 + [p["d_cw"] / 2] * 4, 6.0)
    assert engine.angles() == pytest.approx([0.0] * 8, abs=1e-4)


def test_a_parked_vehicle_stays_on_a_slope_at_half_its_dry_friction(
    prototype: Prototype, make_engine: MakeEngine
) -> None:
    p, g = prototype.truth, prototype.geometry
    slope = math.asin(0.5 * 4 * p["d_cw"] / g.wheel_radius / (p["m_ch"] * GRAVITY))
    engine = make_engine(replace(AsBuilt.of(prototype), slope=slope), step_size=STEP, gui=False)
    run(engine, [0.0] * 8, 1.0)
    before = engine.base_pose()[0]
    run(engine, [0.0] * 8, 6.0)
    assert math.dist(before[:2], engine.base_pose()[0][:2]) < 1e-5
    engine.close()


def test_equal_calls_give_equal_bits(prototype: Prototype, make_engine: MakeEngine) -> None:
    def drive() -> tuple[list[float], tuple[tuple[float, ...], ...]]:
        engine = make_engine(AsBuilt.of(prototype), step_size=STEP, gui=False)
        for index in range(400):
            engine.step([0.0] * 4 + [20.0 * math.sin(0.03 * index), 12.0, -9.0, 15.0])
        result = engine.angles(), engine.base_pose()
        engine.close()
        return result

    assert drive() == drive()


def moved_on(source: Engine, target: Engine, heading: float) -> None:
    """The second vehicle in the state of the first."""
    target.set_motion(heading=heading, twist=source.twist(), angles=source.angles(), rates=source.mean_rates())


def test_a_vehicle_that_is_set_in_motion_goes_on_as_the_one_that_drove(
    prototype: Prototype, make_engine: MakeEngine
) -> None:
    """On a curve, into another heading: speeds and angles a third of a second later are the same."""
    g, rolling = prototype.geometry, [3 * prototype.truth["d_cw"]] * 4
    left, right = (math.atan(0.2 * g.wheelbase / (1 - s * 0.2 * g.track_width)) for s in (1, -1))
    first, second = (make_engine(AsBuilt.of(prototype), step_size=STEP, gui=False) for _ in range(2))
    first.place(on_stand=False, angles=[left, -left, right, -right, 0, 0, 0, 0])
    run(first, [0.0] * 4 + rolling, 0.6)
    run(second, [0.0] * 8, 0.1)
    moved_on(first, second, 2.0)
    assert second.twist() == pytest.approx(first.twist(), abs=1e-9)
    assert second.base_pose()[0][:2] == pytest.approx((0.0, 0.0), abs=1e-9)
    for engine in (first, second):
        run(engine, [0.0] * 4 + rolling, 0.3)
    assert second.twist() == pytest.approx(first.twist(), rel=2e-3, abs=2e-4)
    assert second.angles() == pytest.approx(first.angles(), abs=1e-3)
    first.close()
    second.close()


def test_the_centre_is_set_in_motion_wherever_the_mass_is(prototype: Prototype, make_engine: MakeEngine) -> None:
    built = AsBuilt.of(shifted(prototype, 0.1, 0.05))
    engine = make_engine(built, step_size=STEP, gui=False)
    height = engine.base_pose()[0][2]
    twist = (0.4, -0.1, 0.3)
    engine.set_motion(heading=-1.2, twist=twist, angles=[0.0] * 8, rates=[0.0] * 8)
    (x, y, z), (_, _, qz, qw) = engine.base_pose()
    assert (x, y, z) == pytest.approx((0.0, 0.0, height), abs=1e-9)
    assert 2 * math.atan2(qz, qw) == pytest.approx(-1.2, abs=1e-9)
    assert engine.twist() == pytest.approx(twist, abs=1e-9)
    engine.close()


def shifted(prototype: Prototype, x: float, y: float) -> Prototype:
    bodies = prototype.rigid_bodies
    return replace(prototype, rigid_bodies=replace(bodies, chassis=replace(bodies.chassis, centre=(x, y, 0.0))))


def test_wheels_that_are_turned_by_hand_bear_the_weight_as_before(engine: Engine, prototype: Prototype) -> None:
    """A contact of where the wheel stood before would bear some of it."""
    quarter = prototype.truth["m_ch"] * GRAVITY / 4
    for angle in (0.02, -0.31, 1.1, 7.0):
        engine.set_motion(heading=0.1, twist=(0.0,) * 3, angles=[0.0] * 4 + [angle] * 4, rates=[0.0] * 8)
        run(engine, [0.0] * 8, 0.1)
        assert loads(engine) == pytest.approx([quarter] * 4, rel=1e-3)
        assert engine.angles()[ROLLING] == pytest.approx([angle] * 4, abs=1e-6)


def test_on_the_stand_only_joints_are_set_in_motion(engine: Engine, prototype: Prototype) -> None:
    """A wheel coasts down as its friction says."""
    p = prototype.truth
    engine.place(on_stand=True, angles=[0.0] * 8)
    engine.set_motion(heading=0.5, twist=(1.0, 0.0, 0.0), angles=[0.0] * 8, rates=[0.0] * 4 + [8.0] * 4)
    assert engine.base_velocity() == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    run(engine, [0.0] * 8, 0.05)
    lost = p["d_cw"] / p["B_w"] * 0.05
    assert engine.mean_rates()[ROLLING] == pytest.approx([8.0 - lost] * 4, rel=1e-6)


@pytest.mark.parametrize(("toe_in", "most"), [(1e-5, 2e-3), (1e-4, 0.2)])
def test_wheels_that_are_parallel_but_for_what_encoders_resolve_do_not_drag(
    prototype: Prototype, make_engine: MakeEngine, toe_in: float, most: float
) -> None:
    """Contacts harder than a tyre slide sideways with their whole grip, mu N toe_in each, at any slip [N]."""
    p, r = prototype.truth, prototype.geometry.wheel_radius
    engine = make_engine(AsBuilt.of(prototype), step_size=STEP, gui=False)
    engine.place(on_stand=False, angles=[toe_in, -toe_in, -toe_in, toe_in, 0, 0, 0, 0])
    run(engine, [0.0] * 8, 0.5)
    torques = [0.0] * 4 + [p["d_cw"] + 2.0] * 4
    run(engine, torques, 0.5)
    speed = engine.twist()[0]
    run(engine, torques, 0.5)
    acceleration = (engine.twist()[0] - speed) / 0.5
    drag = 4 * 2.0 / r - (p["m_ch"] + 4 * p["B_w"] / r**2) * acceleration
    assert abs(drag) < most
    engine.close()
