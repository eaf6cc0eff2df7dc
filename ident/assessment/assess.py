"""The whole assessment of an identification."""

from __future__ import annotations

from collections.abc import Iterable

from ident.assessment.encoders import encoder_reasons
from ident.assessment.faults import fault_reasons
from ident.assessment.fit import fit_reasons
from ident.assessment.signals import signal_reasons
from ident.assessment.values import value_reasons
from ident.assessment.verdict import Assessment, assessment_of
from ident.estimate.result import Identification
from ident.faults import Fault
from ident.records.record import Record
from ident.vehicle.description import VehicleDescription


def assess(
    identification: Identification, record: Record, vehicle: VehicleDescription, faults: Iterable[Fault] = ()
) -> Assessment:
    """Judge whether a result can be true.

    Args:
        identification: the result.
        record: what it was found from.
        vehicle: what was known before.
        faults: of the record; they come first among their equals.
    """
    return assessment_of(
        [
            *fault_reasons(faults),
            *signal_reasons(record, vehicle),
            *encoder_reasons(record, identification, vehicle.geometry),
            *value_reasons(identification, vehicle),
            *fit_reasons(identification),
        ]
    )
