from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.master import Master
from hil.network import DEFAULT_NETWORK, Network, load_network


@pytest.fixture(scope="session")
def network() -> Network:
    return load_network()


@pytest.fixture(scope="session", params=["network.toml", "compact.toml"])
def network_file(request: pytest.FixtureRequest) -> Path:
    """Each network file that we ship: the vehicles are wired differently."""
    return DEFAULT_NETWORK.with_name(request.param)


@pytest.fixture
def flywheels() -> Flywheels:
    return Flywheels()


@pytest.fixture
def bench(flywheels: Flywheels) -> Iterator[LockstepBench]:
    with LockstepBench(flywheels) as bench:
        yield bench


@pytest.fixture
def master(bench: LockstepBench, network: Network) -> Master:
    return Master(bench.bus, bench.clock, network)


@pytest.fixture
def rewritten_network(tmp_path: Path) -> Callable[..., Network]:
    """The default network file with some text replaced."""

    def rewrite(*replacements: tuple[str, str]) -> Network:
        text = DEFAULT_NETWORK.read_text()
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new)
        for eds in DEFAULT_NETWORK.parent.glob("*.eds"):
            (tmp_path / eds.name).write_text(eds.read_text())
        path = tmp_path / "network.toml"
        path.write_text(text)
        return load_network(path)

    return rewrite
