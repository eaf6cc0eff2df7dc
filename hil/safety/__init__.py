"""What a vehicle does when its master dies: the trial, what was recorded, and the report."""

from hil.safety.report import MasterDeathReport, evaluate
from hil.safety.trial import DeathOfMaster, StopRecord, StopSettings

__all__ = ["DeathOfMaster", "MasterDeathReport", "StopRecord", "StopSettings", "evaluate"]
