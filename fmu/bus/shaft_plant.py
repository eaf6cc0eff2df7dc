"""The plant of a drive alone: whoever imports it has the machine, the FMU has ports for torque, angle and speed."""

from __future__ import annotations

from importlib import resources
from importlib.metadata import version

from fmu.bus.packaging import BusPlant
from fmu.bus.system import PlantPorts
from fmu.interface import Interface
from fmu.packaging import COPYRIGHT
from fmu.variables import Block, Causality, Variability, Variable, VariableTable, numbered


def shaft_plant(name: str) -> BusPlant:
    """The shaft of a motor; C and table of `fmu/bus/shaft`.

    Args:
        name: of the drive, for people.
    """
    table = _table()
    interface = Interface(
        name=f"quasiomni.{name}",
        description=f"CANopen drive {name} on CAN (FMI-LS-BUS), with ports for its shaft",
        version=version("quasiomni"),
        tool=f"quasiomni {version('quasiomni')}",
        copyright=COPYRIGHT,
        license="Apache-2.0",
        table=table,
        dependencies={},
    )
    folder, core = resources.files("fmu.bus") / "shaft", resources.files("fmu.model") / "core.h"
    files = {entry.name: entry.read_bytes() for entry in folder.iterdir() if entry.name.endswith((".c", ".h"))}
    ports = PlantPorts(
        (table["torque"].value_reference,), (table["angle"].value_reference,), (table["speed"].value_reference,), ()
    )
    return BusPlant(interface, {**files, "core.h": core.read_bytes()}, ports, ("torque",))


def _table() -> VariableTable:
    def row(name: str, description: str, causality: Causality, block: Block, unit: str, **more: float) -> Variable:
        return Variable(name, description, causality, Variability.CONTINUOUS, block, unit, **more)  # type: ignore[arg-type]

    return numbered(
        [
            [row("time", "Simulation time", Causality.INDEPENDENT, Block.TIME, "s")],
            [row("turned", "Angle that the shaft has turned", Causality.OUTPUT, Block.STATE, "rad", start=0.0)],
            [
                row(
                    "angle",
                    "Angle of the shaft, as the encoder sees it",
                    Causality.INPUT,
                    Block.INPUT,
                    "rad",
                    start=0.0,
                ),
                row("speed", "Speed of the shaft", Causality.INPUT, Block.INPUT, "rad/s", start=0.0),
                row("torque", "Torque as the drive takes it to be", Causality.INPUT, Block.INPUT, "Nm", start=0.0),
            ],
            [
                Variable(
                    "torque_gain",
                    "Torque on the shaft over what the drive takes it for",
                    Causality.PARAMETER,
                    Variability.TUNABLE,
                    Block.PARAMETER,
                    "1",
                    start=1.0,
                    minimum=0.0,
                    maximum=10.0,
                )
            ],
            [
                row("shaft_torque", "Torque on the shaft", Causality.OUTPUT, Block.OUTPUT, "Nm"),
                row("power", "Power given to the shaft", Causality.OUTPUT, Block.OUTPUT, "Nm/s"),
            ],
        ]
    )
