"""Whether the model inside an FMU was assessed as unusable, before any of its code is loaded."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path
from typing import Any

from ident.assessment.file import refuse_unusable
from ident.reading import LARGEST_TEXT, parse_toml

_PARAMETERS = "documentation/parameters.toml"


def refuse_unusable_fmu(path: Path, *, force: bool) -> None:
    """Refuse an FMU whose parameters were assessed as unusable; one of another maker says nothing and passes.

    Raises:
        UserError: its parameters are unusable, or are no file of parameters.
    """
    refuse_unusable(_parameters_in(path), str(path), force=force)


def _parameters_in(path: Path) -> dict[str, Any]:
    """The file of parameters that an FMU carries, empty without any; its importer refuses an FMU that is broken."""
    try:
        with zipfile.ZipFile(path) as archive, archive.open(_PARAMETERS) as file:
            content = file.read(LARGEST_TEXT + 1)
    except (OSError, KeyError, ValueError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error):
        return {}
    return parse_toml(content, f"{path}: {_PARAMETERS}")
