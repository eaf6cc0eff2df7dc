"""A campaign before it moves: excitations, loop designs, the room it takes, the limits it keeps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from ident.campaign.axis import Axis, axis_of
from ident.campaign.controller import LoopLimits
from ident.campaign.dither import add_dither
from ident.campaign.lane_change import LaneChange, lane_change_reference
from ident.campaign.loops import STEERING_RATE_CYCLES, LoopDesign, design_loop
from ident.campaign.optimise import Excitation, Problem, optimise
from ident.campaign.reference import (
    LIFTED_LOOPS,
    STEERING_LOOPS,
    Reference,
    alignment_reference,
    excitation_path,
    excitation_reference,
    repeats_of,
    turn_reference,
)
from ident.campaign.steps import DIAGNOSTIC, DRIVING_ORDER, EXCITATIONS, ORDER, PERIODS, Posture, StepSpec
from ident.errors import CampaignError
from ident.estimate.filters import Processing
from ident.records.record import Step
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import Parameters

Array = NDArray[np.float64]
T = TypeVar("T")

FOLLOWING_ERRORS: Final = {"alpha": 0.35, "x": 0.25, "y": 0.25, "gamma": 0.35, "beta": 3.0}
"""Largest position error before a campaign stops, by coordinate [rad or m]."""

DEAD_BANDS: Final = {"alpha": 6e-5, "x": 5e-4, "y": 5e-4, "gamma": 5e-4, "beta": 5e-3}
"""Position error at standstill that the integrators leave alone, by coordinate [rad or m]."""

HOLDING_BAND: Final = 3e-3
"""The same for a coordinate that stands still throughout a step [rad or m]."""

MOST_PERIODS: Final = 100
"""Repeats of an excitation, at most: a step is planned, driven and decoded as a whole."""

INTEGRAL_SHARE: Final = 3.0
"""Bound of an integrator in units of the coordinate's Coulomb friction."""


@dataclass(frozen=True)
class Room:
    """Floor that a campaign covers, from its start [m]: ahead, behind, to the left, to the right."""

    ahead: float
    behind: float
    left: float
    right: float

    @property
    def length(self) -> float:
        """Along the vehicle [m]."""
        return self.ahead + self.behind

    @property
    def width(self) -> float:
        """Across the vehicle [m]."""
        return self.left + self.right


@dataclass(frozen=True)
class Plan:
    """Everything that is decided before the vehicle moves.

    Attributes:
        vehicle: what is known of it.
        steps: in order, without the alignments between them.
        excitations: of the excitation steps.
        designs, limits: of every loop, by coordinate.
        periods: repeats of an excitation, before the factor of its step.
        cycle: T_s [s].
        manoeuvre: the lane change.
        specs: the excitation steps that there are.
    """

    vehicle: VehicleDescription
    steps: tuple[str, ...]
    excitations: Mapping[str, Excitation]
    designs: Mapping[str, LoopDesign]
    limits: Mapping[str, LoopLimits]
    periods: int
    cycle: float
    manoeuvre: LaneChange
    specs: Mapping[str, StepSpec] = field(default_factory=lambda: DIAGNOSTIC)

    def reference(self, step: str, parameters: Parameters) -> Reference:
        """The reference of a step, feed-forward by `parameters`."""
        if step == Step.LANE_CHANGE:
            return lane_change_reference(self.manoeuvre, self.vehicle, parameters, self.cycle)
        spec = self.specs[step]
        if spec.turn:
            return turn_reference(spec, self.vehicle, parameters, self.cycle)
        series, periods = self.excitations[spec.like or step].series, self._periods(spec)
        reference = excitation_reference(spec, series, periods, self.vehicle, parameters, self.cycle)
        return add_dither(reference, spec, self.vehicle) if spec.dithers else reference

    def alignment(self, start: Array, step: str, parameters: Parameters) -> Reference:
        """Reference that takes the steering from `start` (2,) to where `step` begins."""
        return alignment_reference(start, self.posture(step), self.vehicle, parameters, self.cycle)

    def posture(self, step: str) -> Array:
        """Steering angles (2,) [rad] at which a step begins."""
        posture = self.specs[step].posture if step in self.specs else Posture.AHEAD
        return posture.angles(self.vehicle.geometry)

    def repeats(self, step: str) -> NDArray[np.int64]:
        """Number of the repeat, -1 outside of any, of every sample of an excitation step's reference."""
        spec = self.specs[step]
        if spec.turn:
            return self.reference(step, self.vehicle.prior).period
        return repeats_of(spec, self._periods(spec), self.cycle)

    def _periods(self, spec: StepSpec) -> int:
        return math.ceil(self.periods * spec.repeats)

    def _path(self, step: str) -> Array:
        """Poses (n, 3) that the chassis takes in a step, those of repeats once."""
        if step == Step.LANE_CHANGE or self.specs[step].turn:
            return self.reference(step, self.vehicle.prior).path
        spec = self.specs[step]
        return excitation_path(spec, self.excitations[spec.like or step].series, self.cycle)

    def room(self) -> Room:
        """Floor that the planned steps cover, wheels included (paper, section 6.2)."""
        half = self.vehicle.geometry.footprint[0] / 2
        reaches = np.vstack([self._path(step) for step in self.steps])
        low, high = reaches.min(axis=0), reaches.max(axis=0)
        return Room(high[0] + half, half - low[0], high[1] + half, half - low[1])


def make_plan(
    vehicle: VehicleDescription,
    generator: np.random.Generator,
    *,
    steps: Sequence[str],
    periods: int,
    cycle: float,
    processing: Processing | None = None,
    progress: Callable[[str], None] | None = None,
    specs: Mapping[str, StepSpec] = DIAGNOSTIC,
) -> Plan:
    """Optimise the excitations of the steps, then assemble the plan.

    Args:
        vehicle: what is known of it.
        generator: of the random starts of the optimisation.
        steps: to drive, in any order.
        periods: repeats of every excitation.
        cycle: T_s [s].
        processing: of the estimate, whose mask the excitation takes into account.
        progress: called with every excitation that is ready.
        specs: the excitation steps that there are.

    Raises:
        CampaignError: there is no step, or the steps need more floor than the vehicle file allows.
    """
    excitations: dict[str, Excitation] = {}
    for step in DRIVING_ORDER:
        if step in steps and step in specs and specs[step].optimised:
            excitations[step] = _excitation(specs[step], vehicle, processing or Processing(), generator)
            if progress is not None:
                progress(step)
    return assemble_plan(vehicle, excitations, steps=steps, periods=periods, cycle=cycle, specs=specs)


def assemble_plan(
    vehicle: VehicleDescription,
    excitations: Mapping[str, Excitation],
    *,
    steps: Sequence[str],
    periods: int,
    cycle: float,
    specs: Mapping[str, StepSpec] = DIAGNOSTIC,
) -> Plan:
    """A plan from excitations that are given; designs the loops and checks the room.

    Raises:
        CampaignError: there is no step, too few periods, or too little floor.
    """
    if not steps:
        raise CampaignError("The campaign has no step.", f"Choose from {', '.join(ORDER)}.")
    if periods < PERIODS:
        raise CampaignError(
            f"{periods} periods a step do not separate noise from model error.", f"Drive at least {PERIODS}."
        )
    if periods > MOST_PERIODS:
        raise CampaignError(f"{periods} periods a step would take hours.", f"Drive at most {MOST_PERIODS}.")
    _refuse_unlike(steps, excitations, specs)
    axes = {step: axis_of(spec, vehicle) for step, spec in EXCITATIONS.items()}
    plan = Plan(
        vehicle=vehicle,
        steps=tuple(step for step in DRIVING_ORDER if step in steps),
        excitations=excitations,
        designs=_Designs(_by_loop(axes), cycle),
        limits=_by_loop({step: _limits(step, axis) for step, axis in axes.items()}),
        periods=periods,
        cycle=cycle,
        manoeuvre=LaneChange(),
        specs=specs,
    )
    _check_room(plan)
    return plan


def _refuse_unlike(steps: Sequence[str], excitations: Mapping[str, Excitation], specs: Mapping[str, StepSpec]) -> None:
    for step in steps:
        like = specs[step].like if step in specs else ""
        if like and like not in excitations:
            raise CampaignError(f"{step} is driven like {like}, which is left out.", f"Drive {like} too.")


def _excitation(
    spec: StepSpec, vehicle: VehicleDescription, processing: Processing, generator: np.random.Generator
) -> Excitation:
    geometry = vehicle.geometry
    problem = Problem(
        spec, axis_of(spec, vehicle), vehicle.limits, geometry.gear_ratio, vehicle.prior["m_ch"], processing
    )
    return optimise(problem, generator)


class _Designs(Mapping[str, LoopDesign]):
    """Designs of the loops by coordinate, each made when it is first asked for: who reads a run needs none."""

    def __init__(self, axes: Mapping[str, Axis], cycle: float) -> None:
        self._axes, self._cycle = axes, cycle
        self._made: dict[tuple[Axis, int], LoopDesign] = {}

    def __getitem__(self, loop: str) -> LoopDesign:
        key = self._axes[loop], STEERING_RATE_CYCLES if loop in STEERING_LOOPS else 1
        if key not in self._made:
            self._made[key] = design_loop(key[0], self._cycle, key[1])
        return self._made[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._axes)

    def __len__(self) -> int:
        return len(self._axes)


def _limits(step: str, axis: Axis) -> LoopLimits:
    family = EXCITATIONS[step].coordinate.split("_")[0]
    return LoopLimits(FOLLOWING_ERRORS[family], INTEGRAL_SHARE * axis.coulomb, DEAD_BANDS[family], HOLDING_BAND)


def _by_loop(by_step: Mapping[str, T]) -> dict[str, T]:
    loops = {EXCITATIONS[step].coordinate: value for step, value in by_step.items()}
    beta = loops.pop("beta")
    return {**loops, **dict.fromkeys(LIFTED_LOOPS, beta)}


def _check_room(plan: Plan) -> None:
    room, limits = plan.room(), plan.vehicle.limits
    for name, need, have in (
        ("long", room.length, limits.floor_length),
        ("wide", room.width, limits.floor_width),
    ):
        if need > have:
            raise CampaignError(
                f"The campaign needs a floor {need:.2f} m {name}, {have:.2f} m are there.",
                "Leave out lane_change or lateral (--skip), or set limits.floor_length and floor_width of the "
                "vehicle file to the room there is.",
            )
