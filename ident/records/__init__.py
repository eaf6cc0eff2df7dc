"""The one data contract: a uniformly sampled table in SI units, in memory and in files."""

from ident.records.record import Record, Segment, Step

__all__ = ["Record", "Segment", "Step"]
