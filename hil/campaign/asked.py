"""A diagnosis as it was asked for, for the commands that come after it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from hil.campaign.folder import Run
from ident.report.commands import Asked
from ident.vehicle.description import VehicleDescription, load_vehicle


@dataclass(frozen=True)
class DiagnosisOrder:
    """A diagnosis as it is asked for.

    Attributes:
        records: run folders or files to look for causes in.
        confirm: the same, independent of them; none: a part of `records` confirms.
        vehicle: shipped vehicle file by name, or a path; None: that of the first run folder, or the prototype.
        model: `parameters.toml` under test; None: the parameters are refitted.
        axis: the records are of servo axes.
        seed: of the smooth function of what is left.
        json, report, extended: files to write, or None; `extended` is the model with the effects that are named.
        force: take a model that was assessed as unusable.
        network: network file in place of that of the vehicle or of the run folders.
    """

    records: tuple[Path, ...]
    confirm: tuple[Path, ...]
    vehicle: str | None
    model: Path | None
    axis: bool
    seed: int
    json: Path | None
    report: Path | None
    extended: Path | None = None
    force: bool = False
    network: Path | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """What is to be written."""
        return tuple(path for path in (self.json, self.report, self.extended) if path is not None)


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
