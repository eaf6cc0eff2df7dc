"""Decoding of recorded frames into SI arrays, with the network file alone."""

from hil.frames.decode import LONGEST_GAP, DecodedLog, decode_frames, decode_log
from hil.frames.logs import read_log
from hil.frames.table import FrameTable

__all__ = ["LONGEST_GAP", "DecodedLog", "FrameTable", "decode_frames", "decode_log", "read_log"]
