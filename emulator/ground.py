"""Slippery ground under single wheels, put there and taken away while the vehicle drives."""

from __future__ import annotations

from typing import Final

import pybullet

from emulator.engine import Engine

_FIRST_WHEEL: Final = 4
_LATERAL_FRICTION: Final = 1
_FLOOR: Final = 0


class Ground:
    """Friction between each wheel and the floor; the engine multiplies the coefficients of the two surfaces.

    Placing the vehicle anew (jack-stand, floor) gives it dry ground again.

    Args:
        engine: the physics engine with the vehicle in it.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._dry: dict[int, float] = {}

    def wet(self, wheel: int, coefficient: float) -> None:
        """Let a wheel (fl, rl, fr, rr: 0 to 3) roll on ground with another coefficient of friction [-]."""
        self._dry.setdefault(wheel, self._surface(self._engine.body, self._link(wheel)))
        self._set(wheel, coefficient / self._surface(_FLOOR, -1))

    def dry(self, wheel: int) -> None:
        """Give a wheel the ground back that it had before."""
        if wheel in self._dry:
            self._set(wheel, self._dry.pop(wheel))

    def _link(self, wheel: int) -> int:
        return self._engine.joints[_FIRST_WHEEL + wheel]

    def _surface(self, body: int, link: int) -> float:
        return float(pybullet.getDynamicsInfo(body, link, self._engine.client)[_LATERAL_FRICTION])

    def _set(self, wheel: int, coefficient: float) -> None:
        pybullet.changeDynamics(
            self._engine.body, self._link(wheel), lateralFriction=coefficient, physicsClientId=self._engine.client
        )
