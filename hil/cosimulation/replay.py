"""A record's torques through an FMU, its motion beside the recorded one: the outcome gap."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from hil.cosimulation.instance import FmuInstance
from ident.errors import UserError
from ident.estimate.equations import ROWS, RowsOfStep, motion_of
from ident.estimate.filters import Processing, differentiate
from ident.plant.kinematics import virtual_steering
from ident.records.checks import UNJUDGED
from ident.records.record import PAYLOAD, Record, Segment, Step, base_step
from ident.report.digits import percent, unit_text
from ident.report.figures import MEASURED, MODELLED, drawn
from ident.vehicle.geometry import WHEELS, Geometry
from ident.writing import write_whole

Array = NDArray[np.float64]

FREE_WHEELS: Final = {f"friction_limit_{wheel}": 1e-9 for wheel in WHEELS}
"""The jack-stand: contacts without grip."""

_SIDES: Final = ("l", "r")
_RATES: Final = (
    *("x_dot", "y_dot", "gamma_dot"),
    *(f"alpha_{side}_dot" for side in _SIDES),
    *(f"beta_{wheel}_dot" for wheel in WHEELS),
)
"""States of the FMU in the order of q̇."""


@dataclass(frozen=True)
class Outcome:
    """One driven velocity of one step, recorded and simulated.

    Attributes:
        step, coordinate: whose.
        unit: of the velocity.
        time: (N,) [s].
        measured, simulated: (N,) velocity.
    """

    step: str
    coordinate: str
    unit: str
    time: Array
    measured: Array
    simulated: Array

    @property
    def nrmse(self) -> float:
        """Root mean square of the difference over that of the recorded velocity [-]."""
        return float(np.linalg.norm(self.simulated - self.measured) / np.linalg.norm(self.measured))


def replay(fmu: Path, record: Record, geometry: Geometry) -> Iterator[Outcome]:
    """Simulate every step that drives a coordinate, each from its own recorded start; one outcome a velocity.

    Between two samples the FMU gets the mean of their torques. Both motions pass the same filter and odometry.

    Args:
        fmu: with torque inputs.
        record: to replay.
        geometry: of the vehicle, for odometry.

    Raises:
        FmuError: the FMU cannot be run, or has other inputs.
        UserError: the record holds no step that drives a coordinate.
    """
    driven = [(segment, spec) for segment in record.segments if (spec := _rows_of(segment.step)) is not None]
    if not driven:
        raise UserError(f"{record.source} has no step to replay.", f"Record one of: {', '.join(ROWS)}.")
    for segment, spec in driven:
        yield from _outcomes(segment, simulate(fmu, segment, spec, geometry), spec, geometry)


def _rows_of(step: str) -> RowsOfStep | None:
    known = base_step(step)
    return None if known is None else ROWS.get(Step(known))


def simulate(fmu: Path, segment: Segment, spec: RowsOfStep, geometry: Geometry) -> Segment:
    """The segment with the FMU's angles in place of the recorded ones.

    Raises:
        FmuError: the FMU cannot be run, or has other inputs.
    """
    dt = segment.sample_time
    torques = (segment.motor_torques[:-1] + segment.motor_torques[1:]) / 2
    reported = np.empty((len(segment), 6))
    with FmuInstance(fmu, _start(fmu, segment, spec, geometry)) as instance:
        commanded = instance.port([f"torque_{wheel}" for wheel in WHEELS])
        states = [f"beta_{wheel}" for wheel in WHEELS] + [f"alpha_{side}" for side in _SIDES]
        watched = instance.port([instance.reported(state) for state in states])
        reported[0] = instance.read(watched)
        for sample, torque in enumerate(torques.tolist(), start=1):
            instance.write(commanded, torque)
            instance.step(dt)
            reported[sample] = instance.read(watched)
    return replace(segment, wheel_angles=reported[:, :4], steering_angles=reported[:, 4:])


def _start(fmu: Path, segment: Segment, spec: RowsOfStep, geometry: Geometry) -> Mapping[str, float]:
    """Recorded angles, freed of what the encoders of the model add; rates where it begins in motion; a known load."""
    angles = {f"beta_{wheel}": float(value) for wheel, value in zip(WHEELS, segment.wheel_angles[0], strict=True)}
    with FmuInstance(fmu, {}) as fresh:
        added = fresh.read(fresh.port([f"alpha_{side}_reported" for side in _SIDES]))
    for side, measured, offset in zip(_SIDES, segment.steering_angles[0], added, strict=True):
        angles[f"alpha_{side}"] = float(measured - offset)
    processing = Processing()
    # By a line through samples each of which has been checked against its neighbours.
    smooth = motion_of(segment, geometry, processing).rates
    rates = 2 * smooth[UNJUDGED] - smooth[2 * UNJUDGED]
    moving = np.any(np.abs(rates[3:]) > processing.moving)
    speeds = dict(zip(_RATES, rates.tolist(), strict=True)) if moving else {}
    load = {PAYLOAD: segment.payload} if segment.payload else {}
    return angles | speeds | load | (FREE_WHEELS if spec.mode is None else {})


def _outcomes(segment: Segment, simulated: Segment, spec: RowsOfStep, geometry: Geometry) -> Iterator[Outcome]:
    recorded, ours = _velocities(segment, geometry), _velocities(simulated, geometry)
    for name in spec.coordinates:
        unit = "m/s" if name in ("x", "y") else "rad/s"
        yield Outcome(segment.step, name, unit, segment.time, recorded[name], ours[name])


def _velocities(segment: Segment, geometry: Geometry) -> dict[str, Array]:
    """Every velocity that a step may drive, by the name of its coordinate."""
    motion = motion_of(segment, geometry, Processing())
    names = ("x", "y", "gamma", "alpha_l", "alpha_r", *(f"beta_{wheel}" for wheel in WHEELS))
    velocities = dict(zip(names, motion.rates.T, strict=True))
    virtual = virtual_steering(motion.alpha, geometry)
    return velocities | {"alpha_v": differentiate(virtual, segment.sample_time)}


def write_plot(outcomes: Sequence[Outcome], path: Path) -> None:
    """One self-contained HTML page, a panel an outcome.

    Raises:
        UserError: the file cannot be written.
    """
    titles = [f"{one.step}: {one.coordinate}, difference {percent(one.nrmse)}" for one in outcomes]
    figure = make_subplots(rows=len(outcomes), cols=1, subplot_titles=titles, vertical_spacing=0.25 / len(outcomes))
    for row, outcome in enumerate(outcomes, start=1):
        keep = drawn(len(outcome.time), float(outcome.time[1] - outcome.time[0]), Processing())
        for values, name, colour in (
            (outcome.measured, "recorded", MEASURED),
            (outcome.simulated, "simulated", MODELLED),
        ):
            line = go.Scatter(x=outcome.time[keep], y=values[keep], name=name, line={"color": colour, "width": 1.4})
            figure.add_trace(line.update(showlegend=row == 1, legendgroup=name), row=row, col=1)
        figure.update_yaxes(title_text=unit_text(outcome.unit), row=row, col=1)
    figure.update_xaxes(title_text="time in the step [s]", row=len(outcomes), col=1)
    figure.update_layout(height=260 * len(outcomes), template="plotly_white", hovermode="x unified")
    write_whole(figure.to_html(include_plotlyjs=True), path)
