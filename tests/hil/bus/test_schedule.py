"""Whether a network fits on a real bus, by arithmetic and by what the wire then does."""

from __future__ import annotations

import pytest

from emulator.firmware.flywheels import Flywheels
from hil.bench.lockstep import LockstepBench
from hil.bus.schedule import schedule
from hil.master import Master
from hil.network import Network, load_network


def test_the_eleven_frames_of_a_cycle_load_the_bus_as_the_design_says(network: Network) -> None:
    cyclic = [frame for frame in schedule(network).frames if frame.period == network.cycle_period]
    assert len(cyclic) == 11
    shortest, longest = (sum(bits) / 2000 for bits in zip(*((f.shortest, f.longest) for f in cyclic), strict=True))
    assert shortest == pytest.approx(0.48, abs=0.005)
    assert longest == pytest.approx(0.58, abs=0.005)


def test_lengths_are_those_of_the_standard(network: Network) -> None:
    by_id = {frame.can_id: frame for frame in schedule(network).frames}
    assert (by_id[0x080].shortest, by_id[0x080].longest) == (47, 55)
    assert (by_id[0x181].shortest, by_id[0x181].longest) == (111, 135)


def test_the_networks_that_we_ship_work_on_a_real_bus(network_file) -> None:
    assert schedule(load_network(network_file)).late == ()


@pytest.mark.parametrize("change", [{"period": 0.001}, {"bit_rate": 500e3}])
def test_half_the_time_for_the_same_frames_is_too_little(network: Network, change: dict[str, float]) -> None:
    late = schedule(network, **change).late
    assert {0x201, 0x202, 0x203, 0x204} <= {frame.can_id for frame in late}
    assert 0x080 not in {frame.can_id for frame in late}


def test_frames_are_listed_in_the_order_in_which_they_win(network: Network) -> None:
    ids = [frame.can_id for frame in schedule(network).frames]
    assert ids == sorted(ids)
    assert len(ids) == len(set(ids))


def test_no_frame_of_a_campaign_waits_longer_than_the_schedule_allows(network: Network) -> None:
    longest = max(frame.response for frame in schedule(network).frames)
    with LockstepBench(Flywheels(), delays=True) as bench, Master(bench.bus, bench.clock, network) as master:
        master.boot()
        master.enable()
        for _ in range(500):
            master.exchange((0.1,) * 4)
        assert 0.0 < bench.load.longest_wait <= longest
