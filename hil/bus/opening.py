"""Opens a bus by name, as given on the command line."""

from __future__ import annotations

from pathlib import Path

import can
from can.interfaces import BACKENDS

from hil.bus.unix import UnixBus, UnixHub
from ident.errors import BusError

_OURS = "unix"


def open_bus(name: str, bit_rate: float = 1e6) -> can.BusABC:
    """Open `INTERFACE:CHANNEL`: `unix:/path/of/hub`, or any python-can interface such as `socketcan:can0`.

    Args:
        name: interface and channel.
        bit_rate: [bit/s], for interfaces that set it.

    Raises:
        BusError: the interface is unknown, its driver is missing, or the channel cannot be opened.
    """
    interface, colon, channel = name.partition(":")
    if not colon or not channel:
        raise BusError(f"{name!r} is not INTERFACE:CHANNEL.", "Write for example socketcan:can0 or unix:/tmp/bus.")
    if interface == _OURS:
        return _open_unix(Path(channel))
    if interface not in BACKENDS:
        known = ", ".join(sorted((*BACKENDS, _OURS)))
        raise BusError(f"There is no CAN interface {interface!r}.", f"Use one of {known}.")
    try:
        return can.Bus(interface=interface, channel=channel, bitrate=round(bit_rate), ignore_config=True)
    except (can.CanError, OSError, ImportError, ValueError, TypeError, AttributeError) as error:
        raise BusError(f"{name} cannot be opened: {error}.", _remedy(interface)) from error


def open_served_bus(name: str, bit_rate: float = 1e6) -> can.BusABC:
    """Open a bus for the emulated side: the hub of `unix:/path`, a member of any other.

    Args:
        name: interface and channel.
        bit_rate: [bit/s], for interfaces that set it.

    Raises:
        BusError: the bus cannot be opened.
    """
    interface, _, channel = name.partition(":")
    if interface != _OURS or not channel:
        return open_bus(name, bit_rate)
    try:
        return UnixHub(Path(channel), bit_rate=bit_rate)
    except can.CanError as error:
        raise BusError(f"{name} cannot be opened: {error}.", "Choose another path.") from error


def _open_unix(path: Path) -> can.BusABC:
    try:
        return UnixBus(path)
    except can.CanError as error:
        raise BusError(
            f"unix:{path} cannot be opened: {error}.",
            f"Start the other side first: quasiomni emulate --bus unix:{path}.",
        ) from error


def _remedy(interface: str) -> str:
    try:
        channels = [str(config["channel"]) for config in can.detect_available_configs(interfaces=[interface])]
    except (can.CanError, OSError, ImportError):
        channels = []
    found = f"Channels found: {', '.join(channels)}." if channels else "No channel of this interface was found."
    return f"{found} Check driver, cable and channel."
