"""The CANopen master of the vehicle, over any python-can bus."""

from hil.master.cycle import Sample
from hil.master.master import Master

__all__ = ["Master", "Sample"]
