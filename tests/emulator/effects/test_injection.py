"""The table of injectors: complete, refusing what excludes each other, changing nothing without an effect."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from emulator.effects import inject
from emulator.prototype import load_prototype
from ident.effects import EFFECTS, make_effect
from ident.effects.text import parse_effect
from ident.errors import UserError
from ident.plant.places import members
from ident.vehicle.description import load_vehicle

Make = Callable[..., object]


@pytest.mark.parametrize(("name", "where"), [(kind.name, where) for kind in EFFECTS.values() for where in kind.places])
@pytest.mark.parametrize("prototype", ["prototype", "compact"])
def test_every_effect_can_be_at_each_of_its_places(name: str, where: str, prototype: str) -> None:
    kind, vehicle = EFFECTS[name], load_vehicle(prototype)
    effect = make_effect(name, where, {kind.size.name: kind.usual(vehicle, members(where)[0])})
    plain, changed = (inject(load_prototype(prototype), some, 1e-3) for some in ((), [effect]))
    assert repr(changed) != repr(plain)


def test_several_effects_act_at_once(make: Make) -> None:
    moving = make(
        "torque_bias@drive_fl=0.05Nm", "time_delay@drive_fl=5ms", "stribeck@wheels=1Nm", "slope@chassis=0.3deg"
    )
    moving.torque([10.0] * 4, 0.5)
    assert moving.vehicle.ground_truth().pose[0] > 0


@pytest.mark.parametrize(
    "texts",
    [
        ("slope@chassis=0.1deg", "slope@chassis=0.2deg"),
        ("slip@chassis=0.3", "slip@wheel_rr=0.2"),
        ("stribeck@wheels=1Nm", "stribeck@wheels=2Nm"),
    ],
)
def test_effects_that_exclude_each_other_are_refused(texts: tuple[str, str]) -> None:
    with pytest.raises(UserError, match="exclude each other"):
        inject(load_prototype(), [parse_effect(text) for text in texts], 1e-3)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("asymmetric_coulomb@wheels=9Nm", "more than the friction"),
        ("asymmetric_viscous@steering_left=9", "more than the friction"),
        ("slope@chassis=20deg", "roll away"),
        ("slip@chassis=0", "positive"),
        ("time_delay@drive_fl=-1ms", "before its cause"),
        ("backlash@drive_fl=-1mrad", "cannot be negative"),
        ("scrub@steering_left=-1Nm", "cannot be negative"),
        ("payload@chassis=-5kg", "negative"),
        ("com_offset@chassis=2m", "tip over"),
        ("steering_unit_mass@chassis=500kg", "do not fit"),
        ("parameter_change@d_cw=-150%", "negative"),
    ],
)
def test_what_no_vehicle_can_have_is_refused_with_a_reason(text: str, reason: str) -> None:
    with pytest.raises(UserError, match=reason):
        inject(load_prototype(), [parse_effect(text)], 1e-3)


def test_without_effects_nothing_stands_between_drives_and_joints(make: Make) -> None:
    one, other = make(), make()
    for moving in (one, other):
        moving.torque([8.0, 9.0, 10.0, 11.0], 0.3)
    assert one.vehicle.ground_truth() == other.vehicle.ground_truth()
