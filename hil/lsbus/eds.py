"""The EDS of a device as the FMU has it: the objects that its C firmware serves, and no other."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from emulator.firmware.description import DRIVE_ROLES
from fmu.bus.system import DeviceKind

_SERVICES: Final = frozenset(
    (0x1000, 0x1001, 0x1003, *range(0x1005, 0x100B), *range(0x1014, 0x101A), 0x1021, 0x1022, 0x1029, 0x1200)
)
"""Objects of CiA 301 beside those of PDOs."""

_PDOS: Final = range(0x1400, 0x1C00)

_DRIVE: Final = frozenset(
    (
        *(0x6007, 0x603F, 0x6040, 0x6041, 0x605A, 0x605B, 0x605C, 0x605E, 0x6060, 0x6061, 0x6064, 0x606B, 0x606C),
        *(0x606F, 0x6070, 0x6071, 0x6072, 0x6073, 0x6074, 0x6075, 0x6076, 0x6077, 0x6078, 0x6079, 0x607E, 0x6080),
        *(0x6084, 0x6085, 0x6087, 0x608F, 0x60B2, 0x60C2, 0x60C6, 0x60E0, 0x60E1, 0x60F9, 0x6502),
    )
)
_ENCODER: Final = frozenset((*range(0x6000, 0x6005), 0x6030, 0x6200, *range(0x6500, 0x650C)))
_PROFILES: Final[Mapping[DeviceKind, frozenset[int]]] = {DeviceKind.DRIVE: _DRIVE, DeviceKind.ENCODER: _ENCODER}

SUPPORTED_MODES: Final = 0x6502
CYCLIC_TORQUE_ALONE: Final = 1 << 9
"""6502h of the drives in the FMU: cyclic synchronous torque."""

_SECTION: Final = re.compile(r"^\[([^\]]+)\]\s*$", re.MULTILINE)
_OBJECT: Final = re.compile(r"([0-9A-Fa-f]{4})(sub[0-9A-Fa-f]+|Name|Value|Denotation)?$")
_LISTED: Final = re.compile(r"^\d+\s*=\s*0x([0-9A-Fa-f]+)\s*$", re.MULTILINE)
_LISTS: Final = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")


def kind_of(role: str) -> DeviceKind:
    """The device profile of a role on the vehicle."""
    return DeviceKind.DRIVE if role in DRIVE_ROLES else DeviceKind.ENCODER


def is_served(kind: DeviceKind, index: int) -> bool:
    """Whether the C firmware has an object."""
    return index in _SERVICES or index in _PDOS or index in _PROFILES[kind]


def served_eds(text: str, kind: DeviceKind) -> str:
    """An EDS without the objects that the C firmware does not serve, without LSS, with the modes that there are."""
    starts = [match.start() for match in _SECTION.finditer(text)]
    sections = [text[first:last] for first, last in zip(starts, [*starts[1:], None], strict=True)]
    return "".join(_kept(section, kind) for section in sections)


def _kept(section: str, kind: DeviceKind) -> str:
    name = section[1 : section.index("]")]
    described = _OBJECT.match(name)
    if described:
        index = int(described[1], 16)
        if index == SUPPORTED_MODES and kind is DeviceKind.DRIVE:
            return re.sub(r"(?m)^(DefaultValue\s*=).*$", rf"\g<1>0x{CYCLIC_TORQUE_ALONE:08X}", section)
        return section if is_served(kind, index) else ""
    if name in _LISTS:
        listed = [int(entry, 16) for entry in _LISTED.findall(section)]
        lines = [f"{k}=0x{index:04X}" for k, index in enumerate((i for i in listed if is_served(kind, i)), start=1)]
        return "\n".join([f"[{name}]", f"SupportedObjects={len(lines)}", *lines, "", ""])
    return re.sub(r"(?m)^(LSS_Supported\s*=).*$", r"\g<1>0", section) if name == "DeviceInfo" else section
