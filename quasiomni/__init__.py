"""The command line: the composition root. One module a group of commands; what they do lives in `hil`."""

from quasiomni import can, descriptions, exam, fmu, identification, safety, serving
from quasiomni.application import app, main

__all__ = ["app", "can", "descriptions", "exam", "fmu", "identification", "main", "safety", "serving"]
