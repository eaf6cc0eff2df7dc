"""A diagnosis as it was asked for, for the commands that come after it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from hil.campaign.folder import Run
from ident.report.commands import Asked
from ident.vehicle.description import VehicleDescription, load_vehicle

if TYPE_CHECKING:
    from hil.campaign.diagnosing import DiagnosisOrder


def asked_again(order: DiagnosisOrder) -> Asked:
    """The order, as the commands that come after it need it."""
    files = (order.model, order.network, order.extended)
    model, network, extended = (None if path is None else str(path) for path in files)
    records, confirm = (tuple(map(str, paths)) for paths in (order.records, order.confirm))
    return Asked(records, confirm, model, order.vehicle, network, order.axis, order.seed, extended)


def asked_of_run(order: DiagnosisOrder, run: Run | None, vehicle: VehicleDescription) -> Asked:
    """The same of a vehicle, which a campaign must be told unless it is the prototype.

    Args:
        order: as it was given.
        run: the first run folder among its records, if there is one.
        vehicle: of the records.
    """
    prototype = load_vehicle()
    usual = (vehicle.geometry, vehicle.limits) == (prototype.geometry, prototype.limits)
    return replace(
        asked_again(order),
        run=None if run is None else str(run.folder.path),
        campaign_vehicle=order.vehicle or (None if run is None or usual else str(run.folder.vehicle)),
        bus=None if run is None or run.prototype else run.bus,
        mass=vehicle.prior["m_ch"],
    )
