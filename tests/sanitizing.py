"""C sources and a driver that gives them random input, built with the sanitizers of the compiler."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

from fmu.compiling import HEADERS

Fuzz = Callable[[int, int, str], str]
"""Runs a number of inputs from a seed on, at a level of optimisation; gives what was printed."""

_SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
_WARNINGS = ("-Wall", "-Wextra", "-Werror")


def sanitized(compiler: str, sources: Mapping[str, bytes], driver: Path, folder: Path) -> Fuzz:
    """The program of a driver, compiled once a level of optimisation; whatever the sanitizers find fails the test."""
    for name, text in sources.items():
        (folder / name).write_bytes(text)
    units = sorted(name for name in sources if name.endswith(".c"))

    def run(seed: int, count: int, level: str) -> str:
        program = folder / f"fuzz{level}"
        if not program.exists():
            flags = ["-g", level, "-std=gnu11", *_SANITIZERS, *_WARNINGS, "-I", str(HEADERS), "-I", "."]
            subprocess.run([compiler, *flags, "-o", program, *units, str(driver), "-lm"], cwd=folder, check=True)
        done = subprocess.run([program, str(seed), str(count)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run
