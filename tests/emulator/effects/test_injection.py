"""The table of injectors: complete, refusing what excludes each other, changing nothing without an effect."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from emulator.effects.injection import INJECTORS, inject
from emulator.prototype import load_prototype
from ident.errors import UserError
from ident.vehicle.effect_text import parse_effect
from ident.vehicle.effects import EFFECTS, EffectName, make_effect

Make = Callable[..., object]

SMALL = {
    EffectName.STRIBECK: 0.5,
    EffectName.ASYMMETRIC_COULOMB: 0.3,
    EffectName.ASYMMETRIC_VISCOUS: 0.1,
    EffectName.QUADRATIC_DRAG: 0.05,
    EffectName.SLOPE: 0.005,
    EffectName.COM_OFFSET: 0.05,
    EffectName.PAYLOAD: 40.0,
    EffectName.TORQUE_GAIN: 0.05,
    EffectName.TORQUE_BIAS: 0.03,
    EffectName.TORQUE_RIPPLE: 0.03,
    EffectName.TIME_DELAY: 0.004,
    EffectName.BACKLASH: 0.005,
    EffectName.ELASTICITY: 0.0005,
    EffectName.WHEEL_RADIUS: 0.001,
    EffectName.WHEEL_ECCENTRICITY: 1e-4,
    EffectName.STEERING_OFFSET: 0.01,
    EffectName.SLIP: 0.3,
    EffectName.SCRUB: 3.0,
    EffectName.STEERING_UNIT_MASS: 3.0,
    EffectName.PARAMETER_CHANGE: 0.1,
}


def test_every_effect_has_an_injector() -> None:
    assert set(INJECTORS) == set(EFFECTS)


@pytest.mark.parametrize(("name", "where"), [(name, where) for name in EffectName for where in EFFECTS[name].places])
@pytest.mark.parametrize("prototype", ["prototype", "compact"])
def test_every_effect_can_be_at_each_of_its_places(name: EffectName, where: str, prototype: str) -> None:
    effect = make_effect(name, where, {EFFECTS[name].size.name: SMALL[name]})
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
        ("backlash@drive_fl=-1mrad", "not negative"),
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
