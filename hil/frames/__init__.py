"""Decoding of recorded frames into SI arrays, with the network file alone."""

from hil.frames.decode import DecodedLog, decode_frames, decode_log
from hil.frames.logs import read_log
from hil.frames.table import FrameTable

__all__ = ["DecodedLog", "FrameTable", "decode_frames", "decode_log", "read_log"]
