"""What hardware-in-the-loop tests import, so that they read like sentences: `expect(all_drives("fault")).within(0.1)`.

The fixtures come from the pytest plugin, `hil.pytest_plugin.plugin`.
"""

from hil.pytest_plugin.conditions import (
    Condition,
    all_drives,
    at_rest,
    drive,
    emergency,
    frame,
    heartbeat_state,
    moving,
    travelled,
)
from hil.pytest_plugin.expectations import Expect
from hil.pytest_plugin.health import Symptom
from hil.pytest_plugin.world import World

__all__ = [
    "Condition",
    "Expect",
    "Symptom",
    "World",
    "all_drives",
    "at_rest",
    "drive",
    "emergency",
    "frame",
    "heartbeat_state",
    "moving",
    "travelled",
]
