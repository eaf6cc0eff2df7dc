"""What the filters of the diagnosis leave of published records: why a row is refused.

    python examples/published_filters.py ~/published

A row a record to fit: cutoff of the position filter, the time beside a reversal that the first filter of the rows makes
unusable, and for each axis the share of the samples that is left.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from published_machines import ROWS, read_row

from ident.diagnosis.axis.motion import LEAST_BAND, ROWS_CUTOFF
from ident.diagnosis.axis.reference import axis_signals, largest_cutoff
from ident.errors import UserError
from ident.estimate.axis.cutoff import position_cutoff

MEMORY: Final = 4.0
"""Of the rows' filter over its cutoff."""


def lines(folder: Path) -> Iterator[str]:
    """The table, as Markdown; rows without records, or with ones that are refused before, say so."""
    yield "| row | cutoff | beside a reversal | left |"
    yield "|---|---|---|---|"
    for row in ROWS:
        try:
            fit, confirm = read_row(row, folder)
            cutoff = min(largest_cutoff([*fit, *confirm]), *(position_cutoff(record, LEAST_BAND) for record in fit))
            first = ROWS_CUTOFF * cutoff
            for record in fit:
                moving = [motion.moving.mean() for motion in axis_signals(record, cutoff, first).motions]
                left = ", ".join(f"{share:.0%}" for share in moving)
                shown = (f"{cutoff / (2 * math.pi):.2f} Hz", f"{MEMORY / first:.2f} s", left)
                yield f"| {row.machine}, {row.title} | {' | '.join(shown)} |"
        except UserError as error:
            yield f"| {row.machine}, {row.title} | {error} | | |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where the repositories are")
    for line in lines(parser.parse_args().folder):
        print(line, flush=True)


if __name__ == "__main__":
    main()
