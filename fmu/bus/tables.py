"""C tables of the devices on a bus: `qb_tables.h` and `qb_tables.c` for `fmu/bus/firmware`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from fmu.bus.system import BusSystem, ObjectRow, PlantPorts, TxClock

_FLAGS: Final = {
    "signed": "QB_SIGNED",
    "readable": "QB_READABLE",
    "writable": "QB_WRITABLE",
    "receivable": "QB_RECEIVABLE",
    "transmittable": "QB_TRANSMITTABLE",
    "of_node": "QB_OF_NODE",
}

_COMMUNICATION: Final = (0x1400, 0x1800)
"""First communication parameter of RPDOs and TPDOs; there are up to 512 of each."""

_A_LINE: Final = 24
"""Bytes of a text on one line."""


def bus_tables(system: BusSystem, ports: PlantPorts) -> dict[str, bytes]:
    """The generated C files, by name."""
    return {"qb_tables.h": _header(system).encode(), "qb_tables.c": _rows(system, ports).encode()}


def _header(system: BusSystem) -> str:
    defines = {**_sizes(system), **_sheet(system)}
    lines = "\n".join(f"#define {name} {value}" for name, value in defines.items())
    return f"""/* Sizes and data sheets of the devices. Generated. */
#ifndef QB_TABLES_H
#define QB_TABLES_H

{lines}

#endif
"""


def _sizes(system: BusSystem) -> Mapping[str, str]:
    pdos = 1 + max(
        (
            row.index - first
            for device in system.devices
            for row in device.objects
            for first in _COMMUNICATION
            if first <= row.index < first + 512
        ),
        default=0,
    )
    return {
        "QB_NODES": str(len(system.nodes)),
        "QB_DRIVES": str(len(system.mountings)),
        "QB_HAS_STEERING": str(int(bool(system.discs))),
        # An array has at least one element.
        "QB_ENCODERS_MIN": str(max(1, len(system.discs))),
        "QB_PDOS": str(pdos),
        "QB_TRIGGERED": str(int(system.tx_clock is TxClock.TRIGGERED)),
        "QB_OBJECTS": str(max(len(device.objects) for device in system.devices)),
    }


def _sheet(system: BusSystem) -> Mapping[str, str]:
    sheet = system.drive
    numbers = {
        "QB_PERMILLE": sheet.rated_torque / 1000.0,
        "QB_RATED_TORQUE": sheet.rated_torque,
        "QB_PEAK_TORQUE": sheet.peak_torque,
        "QB_PEAK_LEVEL": sheet.peak_level,
        "QB_PEAK_TIME": sheet.peak_time,
        "QB_STALL_TIME": sheet.stall_time,
        "QB_KEEP": sheet.keep,
        "QB_FROM_START": sheet.from_start,
        "QB_FROM_END": sheet.from_end,
        "QB_SUPPLY_ENERGY": sheet.supply_energy,
        "QB_CHOPPER_ENERGY": sheet.chopper_energy,
        "QB_TRIP_ENERGY": sheet.trip_energy,
        "QB_CAPACITANCE": sheet.capacitance,
        "QB_CHOPPED": sheet.chopped,
        "QB_CHOPPER_VOLTAGE": sheet.chopper_voltage,
        "QB_OVER_VOLTAGE_LEVEL": sheet.over_voltage,
        "QB_COPPER": sheet.copper,
        "QB_HEATING": sheet.heating,
        "QB_GEAR_RATIO": system.gear_ratio,
        "QB_NOISE_TORQUE": system.torque_noise,
        "QB_NOISE_ENCODER": system.encoder_noise,
    }
    integers = {
        "QB_COUNTS": sheet.counts,
        "QB_RAMP_STEPS": sheet.ramp_steps,
        "QB_RATED_TORQUE_MNM": round(sheet.rated_torque * 1e3),
        "QB_RATED_CURRENT_MA": round(sheet.rated_current * 1e3),
        "QB_ENCODER_COUNTS": system.encoder_counts,
        "QB_BIT_RATE": system.bit_rate,
    }
    return {name: repr(float(value)) for name, value in numbers.items()} | {
        name: str(value) for name, value in integers.items()
    }


def _rows(system: BusSystem, ports: PlantPorts) -> str:
    texts: list[bytes] = []
    objects = [_objects(number, device.objects, texts) for number, device in enumerate(system.devices)]
    devices = (
        f"{{{device.kind.value}, objects_{number}, {len(device.objects)}}}"
        for number, device in enumerate(system.devices)
    )
    places = (f"{{{node.device}, {node.node_id}, {node.place}}}" for node in system.nodes)
    mountings = (
        f"{{{one.shaft_ratio!r}, {one.shaft_ratio * system.drive.counts / math.tau!r}}}" for one in system.mountings
    )
    discs = [f"{{{disc.scale!r}, {disc.zero}}}" for disc in system.discs] or ["{0.0, 0}"]
    references = {
        "qb_torques[QB_DRIVES]": ports.torques,
        "qb_wheel_angles[QB_DRIVES]": ports.wheel_angles,
        "qb_wheel_rates[QB_DRIVES]": ports.wheel_rates,
        "qb_steering_angles[QB_ENCODERS_MIN]": ports.steering_angles or (0,),
    }
    return "\n".join(
        [
            "/* Object dictionaries, nodes, and where the plant has what they see. Generated. */",
            '#include "bus.h"',
            "",
            *(_text(number, text) for number, text in enumerate(texts)),
            _array("qb_text qb_texts[]", (f"{{text_{number}, {len(text)}}}" for number, text in enumerate(texts))),
            *objects,
            _array("qb_device qb_devices[]", devices),
            _array("qb_place qb_places[QB_NODES]", places),
            _array("qb_mounting qb_mountings[QB_DRIVES]", mountings),
            _array("qb_disc qb_discs[QB_ENCODERS_MIN]", discs),
            *(_array(f"unsigned {name}", map(str, values)) for name, values in references.items()),
        ]
    )


def _array(declaration: str, rows: Iterable[str]) -> str:
    return f"const {declaration} = {{\n" + ",\n".join(f"    {row}" for row in rows) + "\n};\n"


def _text(number: int, text: bytes) -> str:
    lines = (text[first : first + _A_LINE] for first in range(0, max(1, len(text)), _A_LINE))
    # Bytes as numbers: compilers disagree on how long a literal may be.
    rows = (", ".join(map(str, line)) or "0" for line in lines)
    return "static " + _array(f"unsigned char text_{number}[]", rows)


def _objects(number: int, rows: Sequence[ObjectRow], texts: list[bytes]) -> str:
    return "static " + _array(f"qb_object objects_{number}[]", [_object(row, texts) for row in rows])


def _object(row: ObjectRow, texts: list[bytes]) -> str:
    flags = [flag for name, flag in _FLAGS.items() if getattr(row, name)]
    start = row.start
    if row.text is not None:
        flags.append("QB_TEXT")
        start = len(texts)
        texts.append(row.text)
    numbers = ", ".join(_integer(value) for value in (start, row.minimum, row.maximum))
    return f"{{0x{row.index:04X}, {row.subindex}, {row.size}, {' | '.join(flags) or '0'}, {numbers}}}"


def _integer(value: int) -> str:
    return f"{value}LL" if value > -(2**63) else "(-9223372036854775807LL - 1)"
