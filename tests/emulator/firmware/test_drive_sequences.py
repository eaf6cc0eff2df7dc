"""Sequences of controlwords, modes, targets, faults and NMT commands, drawn at random, against a second description.

The description below was written from CiA 402-2 and docs/drives.md, and shares no code with the drive. It is exact to
the millisecond, because the shaft does not turn by itself and the gains of the drive are zero: a velocity loop then
keeps the torque that it began with.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field, fields

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from emulator.firmware.flywheels import FlywheelDrive, Flywheels
from emulator.power_stage import Trip
from tests.emulator.firmware.coding_table import command_of

NOT_READY, DISABLED, READY, SWITCHED_ON = 0x00, 0x40, 0x21, 0x23
ENABLED, QUICK_STOP, REACTION, FAULT = 0x27, 0x07, 0x0F, 0x08
MOVING = (ENABLED, QUICK_STOP, REACTION)

PP, PV, PT, HM, CSP, CSV, CST, NONE = 1, 3, 4, 6, 8, 9, 10, 0
TORQUE_MODES = (NONE, PT, CST)
HALTING_MODES = (PP, PV, PT, HM)
CYCLIC_MODES = (CSP, CSV, CST)

EDGES = {
    (DISABLED, "shutdown"): READY,
    (READY, "switch on"): SWITCHED_ON,
    (READY, "disable voltage"): DISABLED,
    (READY, "quick stop"): DISABLED,
    (SWITCHED_ON, "shutdown"): READY,
    (SWITCHED_ON, "disable voltage"): DISABLED,
    (SWITCHED_ON, "quick stop"): DISABLED,
}
"""Transitions 2, 3, 6, 7 and 10: nothing moves before or after."""

REST = 10
"""6070h: time at rest that ends a stop [ms]."""

SLOPE = 10
"""6087h as delivered: [per mille / ms]."""

WINDOW = 65535
"""606Dh as delivered [increments / s]."""

FAR = 5_000_000
"""A target that a shaft which stands never reaches [increments]."""


def clip(value: int, limit: int) -> int:
    return max(-limit, min(value, limit))


@dataclass
class Options:
    """6007h, 605Ah to 605Eh, 6072h, 607Ch."""

    abort: int = 1
    quick_stop: int = 2
    shutdown: int = 0
    disable: int = 1
    halt: int = 1
    reaction: int = 2
    limit: int = 3000
    offset: int = 0


@dataclass
class Targets:
    torque: int = 0
    torque_offset: int = 0
    velocity: int = 0
    position_written: bool = False


@dataclass
class Model:
    """One drive as the documents have it; `motion` is "off", "stop" or "mode"."""

    options: Options
    state: int = DISABLED
    mode: int = NONE
    operational: bool = False
    controlword: int = 0
    targets: Targets = field(default_factory=Targets)
    motion: str = "off"
    pending: int | None = None
    halted: bool = False
    torque: int = 0
    base: int = 0
    by_torque: bool = False
    stands: int = 0
    limited: bool = False
    stop_done: bool = False
    reached_for: int = 0
    attained: bool = False
    bit_4: bool = False
    goal: bool = False
    waiting: bool = False
    acknowledged: bool = False
    unknown: bool = False
    followed: bool = False
    count: int = 0
    home: int = 0
    error: int = 0

    # What the master does.

    def control(self, controlword: int) -> None:
        if not self.operational:
            return
        rising = controlword & 0x80 and not self.controlword & 0x80
        self.controlword = controlword
        if rising:
            if self.state == FAULT:
                self.state = DISABLED
                self.error = 0
        else:
            self._command(command_of(controlword))
        self._take_halt(bool(controlword & 0x100))
        if self.pending in (SWITCHED_ON, READY) and controlword & 0x8F == 0x0F and self.state == ENABLED:
            self.pending = None
            self._operate()
        self._take_bit_4()

    def select(self, mode: int) -> None:
        if mode == self.mode:
            return
        self.mode = mode
        self.goal = self.unknown = False
        if self.state == ENABLED and self.pending is None:
            self._operate()

    def aim(self, torque: int | None = None, offset: int | None = None, velocity: int | None = None) -> None:
        targets = self.targets
        targets.torque = targets.torque if torque is None else torque
        targets.torque_offset = targets.torque_offset if offset is None else offset
        targets.velocity = targets.velocity if velocity is None else velocity
        self._follow_torque()

    def aim_at_position(self) -> None:
        self.targets.position_written = True
        self.followed = self.followed or (self.motion == "mode" and self.mode == CSP)

    def nmt(self, operational: bool) -> None:
        leaves = self.operational and not operational
        self.operational = operational
        if leaves and self.state in MOVING:
            if self.options.abort == 1 and self.state != REACTION:
                self.fail(0x8100, fatal=False)
            elif self.options.abort == 2:
                self.targets = Targets()
                self._command("disable voltage")
            elif self.options.abort == 3:
                self._command("quick stop")

    def turn(self, counts: int) -> None:
        self.count += counts

    def fail(self, error: int, *, fatal: bool) -> None:
        self.error = error
        if self.state == FAULT:
            return
        if self.state == REACTION:
            if fatal:
                self._off(FAULT)
            return
        ramp = self.state in MOVING and not fatal and self.options.reaction != 0
        self.targets = Targets()
        if ramp:
            self.state = REACTION
            self._stop(self.options.reaction == 1, FAULT)
        else:
            self._off(FAULT)

    # What follows from it.

    def _command(self, command: str) -> None:
        state, options = self.state, self.options
        resumes = state == QUICK_STOP and options.quick_stop >= 5
        if (state, command) in EDGES:
            self.state = EDGES[state, command]
        elif command == "enable operation" and (state in (READY, SWITCHED_ON) or resumes):
            self._enable()
        elif command == "disable voltage" and state == QUICK_STOP:
            self._off(DISABLED)
        elif state == ENABLED:
            self._leave_operation(command)

    def _leave_operation(self, command: str) -> None:
        """Transitions 5, 8, 9 and 11."""
        options = self.options
        if command == "disable voltage":
            self._off(DISABLED)
        elif command == "switch on":
            self._leave(options.disable == 1, SWITCHED_ON)
        elif command == "shutdown":
            self._leave(options.shutdown == 1, READY)
        elif command == "quick stop":
            self._stop_quickly(options.quick_stop)

    def _stop_quickly(self, option: int) -> None:
        self.state = QUICK_STOP
        self.targets = Targets()
        if option == 0:
            self._off(DISABLED)
        else:
            self._stop(option in (1, 5), DISABLED if option < 5 else None)

    def _enable(self) -> None:
        self.state = ENABLED
        self.pending = None
        self.goal = self.unknown = False
        self.halted = bool(self.controlword & 0x100)
        self._operate()

    def _leave(self, ramp: bool, after: int) -> None:
        if not ramp:
            self._off(after)
        elif self.pending != after:
            self._stop(True, after)

    def _off(self, state: int) -> None:
        self.state = state
        self.pending = None
        self.motion = "off"
        self.torque = 0
        self.limited = self.goal = self.unknown = False

    def _operate(self) -> None:
        if self.halted and self.mode in HALTING_MODES:
            self._stop(self.options.halt == 1, None)
            return
        self.motion = "mode"
        self.base = self.torque
        self.stands = self.reached_for = 0
        self.attained = self.acknowledged = self.waiting = self.followed = False
        self.bit_4 = bool(self.controlword & 0x10)
        if self.mode == CSP:
            self.targets.position_written = False
        self._follow_torque()

    def _stop(self, slow_down: bool, after: int | None) -> None:
        self.motion = "stop"
        self.by_torque = slow_down and self.mode in TORQUE_MODES
        self.pending = after
        self.base = self.torque
        self.stands = 0
        self.stop_done = False

    def _take_halt(self, halted: bool) -> None:
        if halted is self.halted:
            return
        self.halted = halted
        if self.state == ENABLED and self.pending is None and self.mode in HALTING_MODES:
            self._operate()

    def _take_bit_4(self) -> None:
        level = bool(self.controlword & 0x10)
        rises, self.bit_4 = level and not self.bit_4, level
        if self.motion != "mode":
            return
        if self.mode == HM and rises:
            self.attained = True
            self.home = self.count - self.options.offset
        if self.mode == PP:
            self._take_set_point(level, rises)

    def _take_set_point(self, level: bool, rises: bool) -> None:
        if rises and not self.waiting:
            self.acknowledged = True
            self.unknown = self.unknown or not self.targets.position_written
            self.waiting = self.goal and not self.controlword & 0x20
            self.goal = True
        elif not level:
            self.acknowledged = self.waiting

    def _follow_torque(self) -> None:
        if self.motion == "mode" and self.mode == CST:
            asked = self.targets.torque + self.targets.torque_offset
            self.torque = clip(asked, self.options.limit)
            self.limited = self.torque != asked
        elif self.motion == "mode" and self.mode == NONE:
            self.torque = 0
            self.limited = False

    # What time does.

    def millisecond(self) -> None:
        if self.motion == "stop":
            self._stop_on()
        elif self.motion == "mode" and self.mode == PT:
            allowed = clip(self.targets.torque, self.options.limit)
            self.torque += clip(allowed - self.torque, SLOPE)
            self.limited = allowed != self.targets.torque
        elif self.motion == "mode" and self.mode not in TORQUE_MODES:
            offset = self.mode == CSV or (self.mode == CSP and self.followed)
            asked = self.base + (self.targets.torque_offset if offset else 0)
            self.torque = clip(asked, self.options.limit)
            self.limited = self.torque != asked
            self.stands += 1
            self.reached_for = self.reached_for + 1 if abs(self.targets.velocity) <= WINDOW else 0

    def _stop_on(self) -> None:
        if self.by_torque:
            self.torque -= clip(self.torque, SLOPE)
            self.stop_done = self.torque == 0
        else:
            self.stands += 1
            self.stop_done = self.stands >= REST
        self.limited = False
        if self.stop_done and self.pending is not None:
            self._off(self.pending)

    # What the master sees.

    def statusword(self) -> tuple[int, int]:
        """The statusword, and the bits of it that are known."""
        value, known = self.state, 0xFFFF
        value |= 0x10 if self.state in (SWITCHED_ON, *MOVING) else 0
        value |= 0x200 if self.operational else 0
        value |= 0x800 if self.limited else 0
        if self.motion == "stop":
            value |= 0x400 if self.stop_done else 0
        elif self.motion == "mode":
            value |= self._bits_of_mode()
            known &= ~0x1400 if self.mode == PP and self.unknown else known
            # Whether cyclic position can follow is a matter of ramps, with tests of their own.
            known &= ~0x800 if self.mode == CSP else known
        return value, known

    def _bits_of_mode(self) -> int:
        if self.mode in CYCLIC_MODES:
            return 0x1000
        if self.mode == PT:
            return 0x400 if self.torque == self.targets.torque and not self.limited else 0
        if self.mode == PV:
            return (0x400 if self.reached_for >= REST else 0) | (0x1000 if self.stands >= REST else 0)
        if self.mode == HM:
            return 0x1400 if self.attained else 0x400
        if self.mode == PP:
            return (0 if self.goal else 0x400) | (0x1000 if self.acknowledged else 0)
        return 0


@dataclass
class LockedShaft(FlywheelDrive):
    """A shaft that stands where it is put; the last digit of its encoder flickers, as that of a living one."""

    counts: int = 0
    digit: int = 0

    def position(self) -> int:
        self.digit ^= 1
        return self.counts + self.digit

    def velocity(self) -> float:
        return 0.0

    def advance(self, duration: float) -> None:
        """Nothing moves it."""


INDEX_OF = {"abort": 0x6007, "quick_stop": 0x605A, "shutdown": 0x605B, "disable": 0x605C, "halt": 0x605D}
INDEX_OF |= {"reaction": 0x605E, "limit": 0x6072, "offset": 0x607C}
CODES = {"limit": "<H", "offset": "<i"}


class Bench:
    """The drive of the firmware, by frames, beside the description of it."""

    def __init__(self, wire_type) -> None:
        vehicle = Flywheels()
        self.shaft = LockedShaft()
        vehicle.drives = (self.shaft, *vehicle.drives[1:])
        self.wire = wire_type(vehicle=vehicle)
        self.objects = self.wire.devices.nodes[1].object_dictionary
        self.model = Model(Options())

    def begin(self, options: Options) -> None:
        """A drive fresh from its reset."""
        self.shaft.counts = 0
        self.wire.nmt(0x81, 1)
        self.model = Model(options)
        for name in (item.name for item in fields(Options)):
            self.put(INDEX_OF[name], CODES.get(name, "<h"), getattr(options, name))
        for subindex in (1, 3):
            self.put(0x60F9, "<I", 0, subindex)
        self.put(0x6065, "<I", 0xFFFFFFFF)
        # The first RPDO carries the controlword alone, and the TPDOs are silent.
        for index, cob_id in ((0x1400, 0x80000201), (0x1800, 0xC0000181)):
            self.put(index, "<I", cob_id, 1)
        self.put(0x1600, "<B", 1)
        self.put(0x1400, "<I", 0x201, 1)

    def put(self, index: int, code: str, value: int, subindex: int = 0) -> None:
        assert self.wire.write(1, index, subindex, struct.pack(code, value)) == 0

    def act(self, kind: str, value: int) -> None:
        """Do one thing to both."""
        getattr(self, f"_{kind}")(value)
        self.agree()

    def wait(self, milliseconds: int) -> None:
        for _ in range(milliseconds):
            self.wire.devices.advance(round(self.wire.devices.time + 0.001, 9))
            self.model.millisecond()
        self.agree(0xFFFF)

    def agree(self, mask: int = 0x27F) -> None:
        """State and bit 9 at once, everything else a millisecond later."""
        model, read = self.model, self.objects.read
        word, known = model.statusword()
        assert read(0x6041, 0) & known & mask == word & known & mask, (hex(read(0x6041, 0)), hex(word), model)
        assert read(0x6061, 0) == model.mode
        assert read(0x603F, 0) == model.error, model
        assert self.shaft.enabled is (model.state in MOVING)
        if mask == 0xFFFF:
            assert read(0x6074, 0) == model.torque, model
            assert abs(read(0x6064, 0) - (model.count - model.home)) <= 1, model

    def _sdo(self, value: int) -> None:
        self.put(0x6040, "<H", value)
        self.model.control(value)

    def _rpdo(self, value: int) -> None:
        self.wire.send(0x201, struct.pack("<H", value))
        self.model.control(value)

    def _pulse(self, value: int) -> None:
        """Bit 4 up and down again, as a master gives set-points and starts homing."""
        for controlword in (value | 0x10, value & ~0x10):
            self._rpdo(controlword)

    def _mode(self, value: int) -> None:
        self.put(0x6060, "<b", value)
        self.model.select(value)

    def _torque(self, value: int) -> None:
        self.put(0x6071, "<h", value)
        self.model.aim(torque=value)

    def _torque_offset(self, value: int) -> None:
        self.put(0x60B2, "<h", value)
        self.model.aim(offset=value)

    def _velocity(self, value: int) -> None:
        self.put(0x60FF, "<i", value)
        self.model.aim(velocity=value)

    def _position(self, value: int) -> None:
        self.put(0x607A, "<i", value)
        self.model.aim_at_position()

    def _nmt(self, value: int) -> None:
        self.wire.nmt(value, 1)
        self.model.nmt(value == 0x01)

    def _trip(self, value: int) -> None:
        trip, error = ((Trip.OVER_CURRENT, 0x2310), (Trip.OVER_TEMPERATURE, 0x4310))[value]
        self.shaft.trip(trip)
        self.model.fail(error, fatal=trip is Trip.OVER_CURRENT)

    def _turn(self, value: int) -> None:
        self.shaft.counts += value
        self.model.turn(value)


OPTIONS = st.builds(
    Options,
    abort=st.integers(0, 3),
    quick_stop=st.integers(0, 8),
    shutdown=st.integers(0, 1),
    disable=st.integers(0, 1),
    halt=st.integers(1, 4),
    reaction=st.integers(0, 4),
    limit=st.sampled_from((3000, 150)),
    offset=st.sampled_from((0, 5000)),
)
RUNNING = st.sampled_from((0x0F, 0x1F, 0x0F, 0x1F, 0x3F, 0x10F, 0x11F))
USUAL = st.sampled_from((0x06, 0x07, 0x02, 0x00, 0x80, 0x0B, 0x16, 0x17, 0x87))
CONTROLWORDS = st.one_of(RUNNING, RUNNING, RUNNING, USUAL, USUAL, st.integers(0, 0x1FF), st.integers(0, 0xFFFF))
MODES = st.sampled_from((PP, PP, PV, PT, HM, HM, CSP, CSV, CST, NONE))
ACTIONS = st.one_of(
    st.tuples(st.just("rpdo"), CONTROLWORDS),
    st.tuples(st.just("rpdo"), CONTROLWORDS),
    st.tuples(st.just("rpdo"), RUNNING),
    st.tuples(st.just("pulse"), st.sampled_from((0x0F, 0x0F, 0x2F, 0x10F))),
    st.tuples(st.just("sdo"), CONTROLWORDS),
    st.tuples(st.just("sdo"), CONTROLWORDS),
    st.tuples(st.just("mode"), MODES),
    st.tuples(st.just("torque"), st.integers(-600, 600)),
    st.tuples(st.just("torque_offset"), st.integers(-200, 200)),
    st.tuples(st.just("velocity"), st.sampled_from((0, WINDOW, -WINDOW - 1, 10**6))),
    st.tuples(st.just("position"), st.sampled_from((FAR, -FAR))),
    st.tuples(st.just("nmt"), st.sampled_from((0x01, 0x01, 0x80, 0x80, 0x02))),
    st.tuples(st.just("trip"), st.integers(0, 1)),
    st.tuples(st.just("turn"), st.integers(-9000, 9000)),
)
STEPS = st.lists(st.tuples(ACTIONS, st.sampled_from((1, 1, 1, 1, 2, 9, 10, 11, 30))), min_size=6, max_size=30)
STARTS = st.sampled_from(((), (0x06,), (0x06, 0x07), (0x06, 0x0F), (0x06, 0x0F), (0x06, 0x0F), (0x06, 0x0F, 0x02)))
QUIET = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large]


@pytest.fixture(scope="module")
def bench(wire_type) -> Bench:
    return Bench(wire_type)


def run(bench: Bench, options: Options, mode: int, aimed: bool, start: tuple[int, ...], steps) -> None:
    bench.begin(options)
    bench.act("nmt", 0x01)
    bench.act("mode", mode)
    if aimed:
        bench.act("position", FAR)
    for controlword in start:
        bench.act("rpdo", controlword)
    for (kind, value), milliseconds in steps:
        # A stopped node takes no SDO; one that is not operational, no RPDO.
        stopped = bench.wire.devices.nodes[1].nmt.state == 0x04
        if not stopped or kind in ("nmt", "trip", "turn"):
            bench.act(kind, value)
        bench.wait(milliseconds)


DRAWN = given(OPTIONS, MODES, st.booleans(), STARTS, STEPS)


@settings(max_examples=500, deadline=None, suppress_health_check=QUIET)
@DRAWN
def test_no_sequence_leads_anywhere_but_where_the_documents_say(
    bench: Bench, options, mode, aimed, start, steps
) -> None:
    run(bench, options, mode, aimed, start, steps)


@pytest.mark.slow
@settings(max_examples=100_000, deadline=None, suppress_health_check=QUIET, database=None)
@DRAWN
def test_of_a_hundred_thousand_sequences_none_does(bench: Bench, options, mode, aimed, start, steps) -> None:
    run(bench, options, mode, aimed, start, steps)
