"""Both codes that answer what causes a gap (docs/diagnosis.md), by their names in `exam diagnose --core`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from hil.exam.folder import Core
from ident.diagnosis.axis.diagnose import STANDING
from ident.diagnosis.judge import Judge
from ident.diagnosis.posterior.answer import judge_by_posterior

JUDGES: Final[Mapping[str, Judge]] = {str(Core.STANDING): STANDING, str(Core.ONE): judge_by_posterior}
