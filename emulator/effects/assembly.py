"""What stands between drives, joints and sensors: nothing, unless the vehicle has effects there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from emulator.effects.drives import DriveFlaws, MotorTorque, TorqueSource
from emulator.effects.injection import Injection
from emulator.effects.laws import Law, Moment
from emulator.effects.sensors import EncoderFlaws, SensedSteering
from emulator.effects.transmissions import MOTOR_SHARE, FlexibleGear, coupling_torque, make_spring
from emulator.engine.protocol import Engine

_ROLLING: Final = 4
_FLAWLESS: Final = DriveFlaws()


class _Shafts:
    """Motor shafts of a vehicle with flexible gears, in coordinates of the wheels."""

    def __init__(self, engine: Engine, gears: Sequence[FlexibleGear | None]) -> None:
        self.step_size = engine.step_size
        self._engine = engine
        self._gears = gears

    def wheel_angle(self, wheel: int) -> float:
        gear = self._gears[wheel]
        return self._engine.wheel_angle(wheel) if gear is None else gear.angle

    def wheel_rate(self, wheel: int) -> float:
        gear = self._gears[wheel]
        return self._engine.wheel_rate(wheel) if gear is None else gear.rate_now


class Mechanics:
    """Drives to joints, joints to sensors, and the laws of the effects.

    Args:
        injection: what the vehicle has.
        engine: its physics.

    Attributes:
        shafts: the motor shafts as their encoders take them.
        steering: the steering angles as their encoders take them.

    Raises:
        UserError: a spring is stiffer than the engine's step resolves.
    """

    def __init__(self, injection: Injection, engine: Engine) -> None:
        self._engine = engine
        self._injection = injection
        prototype, step = injection.built.prototype, engine.step_size
        self._motor_inertia = MOTOR_SHARE * prototype.truth["B_w"]
        self._gears = [self._gear(wheel) for wheel in range(4)]
        self.shafts = _Shafts(engine, self._gears) if any(self._gears) else engine
        flawless = all(flaws == EncoderFlaws() for flaws in injection.encoders)
        self._sensed = None if flawless else SensedSteering(engine, injection.encoders)
        self.steering = self._sensed or engine
        inertias = (prototype.truth["C_l"] / 2, prototype.truth["C_r"] / 2)
        couplings = (
            coupling_torque(side, coupling, inertias[side], step)
            for side, coupling in enumerate(injection.built.couplings)
            if coupling is not None
        )
        self._laws: tuple[Law, ...] = (*injection.laws, *couplings)
        self._coulomb = list(engine.coulomb)

    @property
    def rigid(self) -> list[bool]:
        """Whether motor and wheel of each drive move alike (4,)."""
        return [gear is None for gear in self._gears]

    def connect(self, stages: Sequence[TorqueSource]) -> None:
        """Take the torque of these power stages (4,)."""
        gear_ratio = self._injection.built.prototype.geometry.gear_ratio
        self._stages = stages
        self._motors = [
            None if flaws == _FLAWLESS else MotorTorque(flaws, stage, gear_ratio, self._engine.step_size)
            for flaws, stage in zip(self._injection.drives, stages, strict=True)
        ]

    def settle(self) -> None:
        """The vehicle has come to rest in another place."""
        for wheel, gear in enumerate(self._gears):
            if gear is not None:
                gear.rest_at(self._engine.wheel_angle(wheel))
        if self._sensed is not None:
            self._sensed.settle()
        self._coulomb = list(self._engine.coulomb)

    def angles_read_as(
        self, steering: tuple[float, float], wheels: Sequence[float], rates: Sequence[float]
    ) -> list[float]:
        """Angles of the joints (8,) [rad] whose encoders read these, while the stages give the torque that they have.

        Args:
            steering: angles of left and right as sensed [rad].
            wheels: (4,) angles of the motors, at the wheel [rad].
            rates: (8,) of the joints [rad/s].
        """
        left, right = (
            angle if self._sensed is None else self._sensed.true_angle(side, angle, rates[2 * side])
            for side, angle in enumerate(steering)
        )
        behind = [
            angle if gear is None else gear.wheel_angle_under(angle, stage.wheel_torque)
            for gear, angle, stage in zip(self._gears, wheels, self._stages, strict=True)
        ]
        return [left, -left, right, -right, *behind]

    def move_on(self, wheels: Sequence[float], rates: Sequence[float]) -> None:
        """The vehicle has been set in motion, and what remembers has known nothing else.

        Args:
            wheels: (4,) angles of the motors, at the wheel [rad].
            rates: (8,) of the joints, of half a step ago [rad/s].
        """
        for gear, angle, rate in zip(self._gears, wheels, rates[_ROLLING:], strict=True):
            if gear is not None:
                gear.move_on(angle, rate)
        for motor in self._motors:
            if motor is not None:
                motor.settle()
        if self._sensed is not None:
            self._sensed.move_on((rates[0], rates[2]))

    def act(self, time: float, rates: Sequence[float], torques: list[float]) -> None:
        """Add to the joint torques (8,) of a step what the drives and the effects do in it."""
        driven = [
            stage.wheel_torque if motor is None else self._through(wheel, motor, rates)
            for wheel, (stage, motor) in enumerate(zip(self._stages, self._motors, strict=True))
        ]
        for joint, torque in enumerate(driven, start=_ROLLING):
            torques[joint] += torque
        if self._laws:
            engine = self._engine
            self._obey_laws(Moment(time, engine, engine.angles(), rates, torques, driven, list(engine.coulomb)))

    def after_step(self) -> None:
        """The engine has made its step."""
        if self._sensed is not None:
            self._sensed.advance()

    def _obey_laws(self, moment: Moment) -> None:
        for law in self._laws:
            law(moment)
        if moment.coulomb != self._coulomb:
            self._coulomb = moment.coulomb
            self._engine.set_friction(moment.coulomb)

    def _through(self, wheel: int, motor: MotorTorque, rates: Sequence[float]) -> float:
        """Torque on a wheel whose drive has flaws [Nm]."""
        gear = self._gears[wheel]
        if gear is None:
            return motor(self._engine.wheel_angle(wheel))
        return gear.advance(motor(gear.angle), self._engine.wheel_angle(wheel), rates[_ROLLING + wheel])

    def _gear(self, wheel: int) -> FlexibleGear | None:
        flaws, step = self._injection.drives[wheel], self._engine.step_size
        if not flaws.flexible:
            return None
        place = ("drive_fl", "drive_rl", "drive_fr", "drive_rr")[wheel]
        spring = make_spring(flaws.compliance, flaws.gap, self._motor_inertia, step, place)
        return FlexibleGear(spring, self._motor_inertia, step)
