"""A picture of an emulated vehicle that turns, drawn by the code that draws videos.

python examples/picture.py docs/images/prototype.png
"""

from __future__ import annotations

import argparse
import math
from contextlib import closing
from pathlib import Path

from PIL import Image

from emulator.as_built import AsBuilt
from emulator.engine.camera import HEIGHT, WIDTH, follow
from emulator.engine.choice import PAINTERS
from emulator.prototype import load_prototype
from ident.extras import EngineName

STEERING = [math.radians(angle) for angle in (18.0, -18.0, 12.0, -12.0)]
ROLLING = [-0.6, 0.5, 0.2, -0.3]
HEADING = math.radians(25.0)


def main() -> None:
    """Draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path)
    parser.add_argument("--vehicle", default="prototype")
    asked = parser.parse_args()
    prototype = load_prototype(asked.vehicle)
    position = (0.0, 0.0, prototype.body.centre_height)
    orientation = (0.0, 0.0, math.sin(HEADING / 2), math.cos(HEADING / 2))
    with closing(PAINTERS[EngineName.PYBULLET](AsBuilt.of(prototype), width=2 * WIDTH, height=2 * HEIGHT)) as painter:
        picture = painter.paint(position, orientation, [*STEERING, *ROLLING], follow(prototype, position, orientation))
    # Drawn twice as large, so that edges are smooth.
    Image.fromarray(picture).resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS).save(asked.path, optimize=True)


if __name__ == "__main__":
    main()
