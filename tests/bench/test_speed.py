"""Speed and memory, as ratios inside one run: machines differ, and differ from minute to minute."""

from __future__ import annotations

import resource
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator.engine.choice import ENGINES
from emulator.prototype import load_prototype
from emulator.vehicle import EmulatedVehicle
from hil.bench.lockstep import LockstepBench
from hil.frames.recorder import Recorder
from hil.master import Master
from hil.network import load_network
from ident.campaign.controller import Controller
from ident.campaign.plan import Plan, make_plan
from ident.campaign.steps import ORDER
from ident.estimate.identify import identify
from ident.extras import EngineName
from ident.records.record import Record, Segment, Step, make_segment
from ident.vehicle.description import load_vehicle

pytestmark = pytest.mark.bench

ROUNDS = 40
CYCLES = 100
CLOSED_LOOP_LIMIT = 4.0
"""The closed loop may cost this many times two bare steps of PyBullet."""
OURS = 150e-6
"""What may be ours of a cycle of the closed loop on MuJoCo, whose bare steps are cheap [s]."""


@pytest.fixture(scope="module")
def plan() -> Plan:
    steps = [step for step in ORDER if step is not Step.LATERAL]
    return make_plan(load_vehicle(), np.random.default_rng(1), steps=steps, periods=5, cycle=0.002)


def cpu_seconds(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def bare_pybullet(engine: Any) -> tuple[Callable[[], None], Callable[[], None]]:
    """What sets a vehicle rolling, and one step of PyBullet's own."""
    pybullet = pytest.importorskip("pybullet")
    client = engine.client
    return (
        lambda: pybullet.resetBaseVelocity(engine.body, [0.5, 0.0, 0.0], physicsClientId=client),
        lambda: pybullet.stepSimulation(client),
    )


def bare_mujoco(engine: Any) -> tuple[Callable[[], None], Callable[[], None]]:
    """What sets a vehicle rolling, and one step of MuJoCo's own."""
    mujoco = pytest.importorskip("mujoco")

    def roll() -> None:
        engine.data.qvel[0] = 0.5

    return roll, lambda: mujoco.mj_step(engine.model, engine.data)


@pytest.mark.parametrize(
    ("name", "bare_of", "limit"),
    [
        (EngineName.PYBULLET, bare_pybullet, lambda steps: CLOSED_LOOP_LIMIT * steps),
        (EngineName.MUJOCO, bare_mujoco, lambda steps: 1.2 * steps + OURS),
    ],
)
def test_the_closed_loop_costs_little_beside_two_bare_engine_steps(
    name: EngineName,
    bare_of: Callable[[Any], tuple[Callable[[], None], Callable[[], None]]],
    limit: Callable[[float], float],
    plan: Plan,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """CAN, firmware, controller and recording included; both moving, friction motors on, turn by turn."""
    reference = plan.reference(Step.STRAIGHT, plan.vehicle.prior)
    limits = plan.vehicle.limits
    controller = Controller(
        reference,
        plan.designs,
        plan.limits,
        gear_ratio=plan.vehicle.geometry.gear_ratio,
        peak_torque=limits.peak_torque,
    )
    loop, bare = [], []
    with (
        EmulatedVehicle(load_prototype(), seed=1, make_engine=ENGINES[name]) as vehicle,
        EmulatedVehicle(load_prototype(), seed=1, make_engine=ENGINES[name]) as rolling,
        LockstepBench(vehicle) as bench,
        Master(bench.bus, bench.clock, load_network(), recorder := Recorder(tmp_path)) as master,
    ):
        master.boot()
        master.enable()
        roll, bare_step = bare_of(rolling.engine)
        roll()
        state = {"index": 0, "sample": master.exchange((0.0, 0.0, 0.0, 0.0))}

        def drive() -> None:
            for _ in range(CYCLES):
                sample, index = state["sample"], state["index"]
                torques = controller.torques(index, sample.wheel_angles, sample.steering_angles)
                state["sample"], state["index"] = master.exchange(torques), index + 1

        def step() -> None:
            for _ in range(2 * CYCLES):
                bare_step()

        for _ in range(ROUNDS):
            loop.append(cpu_seconds(drive) / CYCLES)
            bare.append(cpu_seconds(step) / CYCLES)
            roll()
        recorder.close()
    cycle, steps = statistics.median(loop), statistics.median(bare)
    with capsys.disabled():
        print(
            f"\nclosed loop on {name} {cycle * 1e6:.0f} us a cycle, two bare engine steps {steps * 1e6:.0f} us: "
            f"ratio {cycle / steps:.2f}, {500 * cycle:.3f} s of CPU a simulated second, "
            f"limit {limit(steps) * 1e6:.0f} us"
        )
    assert cycle <= limit(steps)


def test_identifying_200_s_takes_less_than_2_s_of_cpu(plan: Plan, capsys: pytest.CaptureFixture[str]) -> None:
    record = Record([_perfect(plan, step) for step in plan.steps])
    assert record.duration == pytest.approx(200.0, abs=15.0)
    geometry = plan.vehicle.geometry
    identify(record, geometry)
    seconds = min(cpu_seconds(lambda: identify(record, geometry)) for _ in range(3))
    with capsys.disabled():
        print(f"\nidentification of 200 s at 500 Hz: {seconds:.2f} s of CPU (limit 2)")
    assert seconds < 2.0


def test_memory_stays_below_a_gibibyte(capsys: pytest.CaptureFixture[str]) -> None:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    with capsys.disabled():
        print(f"\npeak memory of this process: {peak:.2f} GiB (limit 1)")
    assert peak < 1.0


def _perfect(plan: Plan, step: Step) -> Segment:
    """A step as a vehicle would drive it that is exactly the prior model."""
    reference = plan.reference(step, plan.vehicle.prior)
    wheels, steering = np.zeros((len(reference), 4)), np.zeros((len(reference), 2))
    for name, track in reference.tracks.items():
        wheels += np.cumsum(track.wheels * track.velocity[:, None], axis=0) * reference.sample_time
        if name.startswith("alpha"):
            steering[:, 0 if name == "alpha_l" else 1] = track.position
    time_axis = np.arange(len(reference)) * reference.sample_time
    raw = Segment(step, 0.0, time_axis, reference.feed_forward, wheels, steering, reference.period)
    return make_segment(raw, "bench")
