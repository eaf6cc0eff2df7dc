"""Vehicles and axes that share no code with the model or the emulator, for cases of the exam."""

from __future__ import annotations

import enum


class Source(enum.StrEnum):
    """What drives the cases of an exam."""

    EMULATOR = "emulator"
    FIRST_PRINCIPLES = "first_principles"
    AXES = "axes"
