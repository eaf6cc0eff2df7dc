"""A bus is opened by name; what cannot be opened is refused with what could be."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from hil.bus.opening import open_bus, open_served_bus
from hil.bus.unix import UnixHub
from ident.errors import BusError


def test_any_python_can_interface_opens_by_its_name() -> None:
    with open_bus("virtual:some-channel") as one, can.Bus("some-channel", interface="virtual") as two:
        one.send(can.Message(arbitration_id=0x123, is_extended_id=False))
        received = two.recv(1.0)
    assert received is not None
    assert received.arbitration_id == 0x123


def test_our_own_bus_opens_by_the_path_of_its_hub(tmp_path: Path) -> None:
    with UnixHub(tmp_path / "bus") as hub, open_bus(f"unix:{tmp_path / 'bus'}") as bus:
        bus.send(can.Message(arbitration_id=0x321, is_extended_id=False))
        received = hub.recv(1.0)
    assert received is not None
    assert received.arbitration_id == 0x321


REFUSED = {
    "no channel": ("socketcan", "INTERFACE:CHANNEL"),
    "an empty channel": ("socketcan:", "INTERFACE:CHANNEL"),
    "an unknown interface": ("carrier-pigeon:0", "carrier-pigeon"),
    "a channel that is not there": ("socketcan:can-that-is-not-there", "can-that-is-not-there"),
    "an interface without its driver": ("pcan:PCAN_USBBUS1", "pcan"),
    "a hub that is not there": ("unix:/nowhere/bus", "/nowhere/bus"),
}


@pytest.mark.parametrize(("name", "named"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_opened_is_named_with_a_remedy(name: str, named: str) -> None:
    with pytest.raises(BusError) as caught:
        open_bus(name)
    assert named in str(caught.value)
    assert caught.value.remedy


def test_a_hub_that_cannot_be_opened_is_named_with_a_remedy(tmp_path: Path) -> None:
    name = f"unix:{tmp_path / 'bus'}"
    with open_served_bus(name), pytest.raises(BusError, match="another process"):
        open_served_bus(name)
    with pytest.raises(BusError, match="/nowhere/bus"):
        open_served_bus("unix:/nowhere/bus")
    with pytest.raises(BusError, match="carrier-pigeon"):
        open_served_bus("carrier-pigeon:0")


def test_an_unknown_interface_is_answered_with_the_known_ones() -> None:
    with pytest.raises(BusError) as caught:
        open_bus("carrier-pigeon:0")
    assert all(interface in caught.value.remedy for interface in ("socketcan", "pcan", "unix"))


def test_two_hubs_cannot_share_a_path_but_a_dead_ones_socket_is_taken_over(tmp_path: Path) -> None:
    path = tmp_path / "bus"
    with UnixHub(path), pytest.raises(can.CanInitializationError, match="another process"):
        UnixHub(path)
    dead = UnixHub(path)
    dead._server.close()
    with UnixHub(path) as hub:
        assert hub.recv(0.0) is None


def test_the_end_of_the_hub_is_an_error_for_its_clients_and_not_a_hang(tmp_path: Path) -> None:
    hub = UnixHub(tmp_path / "bus")
    client = open_bus(f"unix:{tmp_path / 'bus'}")
    hub.recv(0.0)
    hub.shutdown()
    with pytest.raises(can.CanOperationError, match="closed"):
        client.recv(10.0)
    client.shutdown()
