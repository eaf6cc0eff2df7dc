"""Damages copies of sound files and opens each in a worker process: `python tests/fuzz/run.py --copies 1000`.

`--only mcap` takes those kinds alone whose names begin so.

Prints a table of what came of them; the summary, and whatever is not as it should be, goes to `--out` as JSON.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from damage import BINARY, TEXT, Damage, hand_made_blf
from material import Material, make_material

MEMORY = 6 << 30
"""Address space of a worker [bytes]; its libraries take a part of it."""
SECONDS = 60.0
"""Time for a file."""


class Worker:
    """A process that opens files; a new one takes its place when it dies or takes too long."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def open(self, kind: str, path: Path, truth: Path) -> dict[str, Any]:
        """What came of a file: `killed` when the process died of it, `late` when it took too long."""
        process = self._process or self._start()
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps({"kind": kind, "path": str(path), "truth": str(truth)}) + "\n")
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], SECONDS)
        line = process.stdout.readline() if ready else ""
        if line:
            outcome: dict[str, Any] = json.loads(line)
            return outcome
        self.close()
        return {
            "how": "killed" if ready else "late",
            "what": "",
            "differs": False,
            "signs": [],
            "worst": 0.0,
            "said": "",
        }

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def _start(self) -> subprocess.Popen[str]:
        worker = Path(__file__).with_name("worker.py")
        self._process = subprocess.Popen(
            [sys.executable, str(worker), str(MEMORY)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )
        assert self._process.stdout is not None
        # However long its libraries take to load, that is no time for a file.
        assert self._process.stdout.readline()
        return self._process


def cases(materials: Sequence[Material], copies: int, seed: int) -> Iterator[tuple[Material, str, Damage, int]]:
    """Material, name of the damage, damage and its seed: the hand-made BLF files first, then all in turn."""
    blf = next((material for material in materials if material.name == "blf packed"), None)
    handmade = list(hand_made_blf().items()) if blf is not None else []
    for number, (name, damage) in enumerate(handmade[:copies]):
        assert blf is not None
        yield blf, name, damage, number
    rng = np.random.default_rng(seed)
    for number in range(max(copies - len(handmade), 0)):
        material = materials[number % len(materials)]
        damages = BINARY if material.binary else TEXT
        name = list(damages)[int(rng.integers(len(damages)))]
        yield material, name, damages[name], seed * 1_000_000 + number


def run(folder: Path, copies: int, seed: int, only: str = "") -> list[dict[str, Any]]:
    """Make, damage and open; what came of each copy.

    Args:
        folder: for the files.
        copies: how many are damaged.
        seed: of the damages.
        only: beginning of the names of the kinds that are taken.
    """
    materials = [material for material in make_material(folder / "sound") if material.name.startswith(only)]
    truths = {"log": folder / "sound" / "log.npz", "record": folder / "sound" / "record.npz"}
    worker, outcomes = Worker(), []
    try:
        for material in materials:
            outcomes.append(_one(worker, material, truths, "nothing", lambda content, _: content, 0, folder))
        for material, name, damage, number in cases(materials, copies, seed):
            outcomes.append(_one(worker, material, truths, name, damage, number, folder))
    finally:
        worker.close()
    return outcomes


def _one(
    worker: Worker,
    material: Material,
    truths: dict[str, Path],
    name: str,
    damage: Damage,
    number: int,
    folder: Path,
) -> dict[str, Any]:
    copy = folder / "copy"
    shutil.copytree(material.folder, copy)
    path = copy / material.file
    path.write_bytes(damage(material.path.read_bytes(), np.random.default_rng(number)))
    outcome = worker.open(material.kind, path, truths.get(material.kind, path))
    outcome |= {"material": material.name, "damage": name, "number": number, "named": names(outcome, copy)}
    shutil.rmtree(copy)
    return outcome


def names(outcome: dict[str, Any], copy: Path) -> bool:
    """Whether a refusal names a file of the copy."""
    return any(path.name in outcome["what"] for path in copy.rglob("*"))


def faults(outcomes: Sequence[dict[str, Any]], limit: float) -> list[dict[str, Any]]:
    """Outcomes that should not be: broken, refused without the file's name, with words besides, or silently wrong.

    Args:
        outcomes: of `run`.
        limit: largest difference without a sign that counts as an answer, as `Outcome.worst`.
    """
    return [
        outcome
        for outcome in outcomes
        if outcome["how"] not in ("refused", "answered")
        or outcome["said"]
        or (outcome["how"] == "refused" and (outcome["damage"] == "nothing" or not outcome["named"]))
        or (outcome["differs"] and not outcome["signs"] and outcome["worst"] > limit)
    ]


def table(outcomes: Sequence[dict[str, Any]]) -> str:
    """One line for each format: how its copies were answered."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for outcome in outcomes:
        how = outcome["how"]
        if how == "answered" and outcome["differs"]:
            how = "with a sign" if outcome["signs"] else "changed"
        counts[outcome["material"]][how] += 1
    columns = ("refused", "answered", "with a sign", "changed", "broken", "killed", "late")
    lines = [f"{'':24}" + "".join(f"{column:>13}" for column in columns)]
    lines += [f"{name:24}" + "".join(f"{count[column]:13}" for column in columns) for name, count in counts.items()]
    return "\n".join(lines)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--copies", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="beginning of the names of the kinds that are taken")
    parser.add_argument("--limit", type=float, default=12.0, help="largest silent difference, as Outcome.worst")
    parser.add_argument("--out", type=Path, help="file of the summary, with every outcome")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        outcomes = run(Path(folder), options.copies, options.seed, options.only)
    wrong = faults(outcomes, options.limit)
    summary = {
        "copies": len(outcomes),
        "how": Counter(outcome["how"] for outcome in outcomes),
        "worst": max((outcome["worst"] for outcome in outcomes), default=0.0),
        "seconds": max(outcome.get("seconds", SECONDS) for outcome in outcomes),
        "peak": max(outcome.get("peak", 0) for outcome in outcomes),
        "faults": wrong,
        "outcomes": outcomes,
    }
    print(table(outcomes))
    print(
        {key: value for key, value in summary.items() if key not in ("faults", "outcomes")},
        f"{len(wrong)} not as they should be",
    )
    if options.out:
        options.out.write_text(json.dumps(summary, indent=1))


if __name__ == "__main__":
    main()
