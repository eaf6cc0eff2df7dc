"""Unmodified SocketCAN programs on a `unix:` bus: a small library, preloaded into them, that needs no kernel module."""

from hil.bus.socketcan.library import build_library, environment, is_served

__all__ = ["build_library", "environment", "is_served"]
