"""The sealing side of an exam of a vehicle: draws the cases, and drives them in their world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from emulator.effects import INJECTORS, Unlibraried, Wanted
from hil.exam.cases import Case, Injected, Kind
from hil.exam.corruptions import corruption_of
from hil.exam.drawing import Composition, draw_cases
from hil.exam.drawn_laws import law_effect
from hil.exam.folder import Exam
from hil.exam.identity import planned_record
from hil.exam.lots import Lots
from hil.exam.order import Order
from hil.exam.plans import ExamPlans, plan_exam, plans_from_text, plans_text
from hil.exam.record_bytes import record_bytes
from hil.exam.sealed import Contents, Progress, Subject, seal_exam
from hil.exam.sizes import SizeTable, beyond_sampling
from hil.exam.workers import run_all
from hil.exam.world import World
from hil.network import load_network
from ident.effects import make_effect
from ident.errors import UserError
from ident.parameters_file import read_model
from ident.vehicle.description import find_data_file, load_vehicle


@dataclass(frozen=True)
class VehicleOrder(Order):
    """An exam of a vehicle.

    Attributes:
        world: vehicle and physics.
        model: file of the model under test.
    """

    world: World
    model: Path


def seal(order: VehicleOrder, table: SizeTable, progress: Progress) -> Exam:
    """Seal an exam of a vehicle, or go on with one that was stopped.

    Raises:
        UserError: as `seal_exam`.
        DataFileError: vehicle or model cannot be read.
    """
    world, composition = order.world, order.composition
    cycle = load_network(world.network_file).cycle_period

    def draw(lots: Lots) -> tuple[list[Case], tuple[str, ...]]:
        read_model(order.model)  # Whether it is one must show now, not when the exam is diagnosed.
        shown = beyond_sampling(table, cycle)
        cases = draw_cases(shown, composition, lots.noise, lots.questions, lots.identifiers)
        return cases, _draw_plans(order, lots, cycle)

    subject = Subject(
        vehicle=world.vehicle,
        engine=world.engine,
        cycle=cycle,
        excitations=composition.driven,
        files={"vehicle.toml": find_data_file("ident.vehicle", world.vehicle), "model.toml": order.model},
        draw=draw,
        drive=drive_case,
        task=lambda exam, case: (exam.plans[case.excitation], world, exam.cycle, case),
    )
    return seal_exam(order, subject, progress)


def drive_case(plans: str, world: World, cycle: float, case: Case) -> Contents:
    """Both records of a case, or why the vehicle cannot be driven with its effects; runs in a worker."""
    both = _plans(plans, world.vehicle, cycle)
    try:
        effects = _effects(case, both, world)
        records = [world.drive(plan, case.seed + index, effects) for index, plan in enumerate(both.driven)]
    except UserError as error:
        return case.identifier, f"{error.what} {error.remedy}\n"
    for fault in case.effects if case.kind is Kind.FAULT else ():
        corruption = corruption_of(fault.name, fault.where, fault.parameter, fault.size)
        records = [corruption.apply(record) for record in records]
    fit, confirm = records
    return case.identifier, (record_bytes(fit), record_bytes(confirm))


def _effects(case: Case, plans: ExamPlans, world: World) -> list[Wanted]:
    """What the vehicle of a case has."""
    match case.kind:
        case Kind.FAULT:
            return []
        case Kind.LAW:
            planned = planned_record(plans.fit, load_vehicle(world.vehicle).prior)
            return [law_effect(law, planned) for law in case.effects]
        case _:
            return [effect_of(injected) for injected in case.effects]


def effect_of(injected: Injected) -> Wanted:
    """What the emulator injects."""
    if not INJECTORS[injected.name].known:
        return Unlibraried(injected.name, injected.where, injected.size)
    return make_effect(injected.name, injected.where, {injected.parameter: injected.size})


@lru_cache(maxsize=Composition.excitations)
def _plans(text: str, vehicle: str, cycle: float) -> ExamPlans:
    return plans_from_text(text, load_vehicle(vehicle), cycle)


def _draw_plans(order: VehicleOrder, lots: Lots, cycle: float) -> tuple[str, ...]:
    tasks = [
        (number, order.world.vehicle, lots.excitation(number), cycle) for number in range(order.composition.driven)
    ]
    return tuple(text for _, text in sorted(run_all(draw_plans, tasks, jobs=order.jobs, scheduler=order.scheduler)))


def draw_plans(number: int, vehicle: str, seed: int, cycle: float) -> tuple[int, str]:
    """A pair of campaigns under its number; runs in a worker."""
    return number, plans_text(plan_exam(load_vehicle(vehicle), seed, cycle))
