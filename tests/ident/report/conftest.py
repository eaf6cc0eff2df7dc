"""What a report of the synthetic campaign shows."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from ident.assessment import assess
from ident.campaign.plan import Plan
from ident.estimate.identify import identify
from ident.estimate.result import Identification, KnownInertia
from ident.records.record import Record
from ident.report.html import ReportContent
from ident.vehicle.description import VehicleDescription
from ident.vehicle.parameters import Parameters


@pytest.fixture(scope="session")
def content(
    identification: Identification,
    record: Record,
    prototype: VehicleDescription,
    truth: Parameters,
    plan: Plan,
) -> ReportContent:
    return ReportContent(
        title="Prototype <1> & its campaign",
        identification=identification,
        assessment=assess(identification, record, prototype),
        record=record,
        vehicle=prototype,
        truth=truth,
        plan=plan,
        provenance={"Seed": "3", "Frames": "runs/<x>/frames.blf"},
        warnings=["The floor was wet."],
    )


@pytest.fixture(scope="session")
def content_without(prototype: VehicleDescription) -> Callable[[Record], ReportContent]:
    """The least there is: a record alone, B_w from a data sheet, neither truth nor plan."""

    def make(record: Record) -> ReportContent:
        known = KnownInertia(0.12, 0.012, "data sheet")
        result = identify(record, prototype.geometry, known_inertia=known)
        assessment = assess(result, record, prototype)
        return ReportContent("A record", result, assessment, record, prototype, None, None, {}, [])

    return make
