"""Whether a result of identification can be true: good, doubtful or unusable, each with its reasons."""

from ident.assessment.assess import assess
from ident.assessment.verdict import Assessment, Reason, ReasonCode, Verdict

__all__ = ["Assessment", "Reason", "ReasonCode", "Verdict", "assess"]
