"""Text in a picture: what the vehicle is doing, and when."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

_BAND: Final = 0.085
"""Height of the band that the text is on, over that of the picture."""
_TEXT: Final = 0.55
"""Size of the text over the height of the band."""
_BAND_COLOUR: Final = (24, 28, 34)
_TEXT_COLOUR: Final = (245, 246, 248)


def write_caption(picture: NDArray[np.uint8], caption: str, time: float) -> NDArray[np.uint8]:
    """The picture (height, width, 3) with a band below it that has the caption at its left and the time at its right.

    Args:
        picture: red, green, blue.
        caption: one line; cut where it is longer than the picture is wide.
        time: simulated [s].
    """
    height, width, _ = picture.shape
    band = round(_BAND * height)
    image = Image.fromarray(picture)
    pen = ImageDraw.Draw(image)
    pen.rectangle((0, height - band, width, height), fill=_BAND_COLOUR)
    font, middle, margin = _font(round(_TEXT * band)), height - band / 2, band / 3
    pen.text((margin, middle), caption, _TEXT_COLOUR, font, anchor="lm")
    clock = f"{time:.2f} s"
    left = width - margin - pen.textlength("00000.00 s", font)
    pen.rectangle((left - margin, height - band, width, height), fill=_BAND_COLOUR)
    pen.text((width - margin, middle), clock, _TEXT_COLOUR, font, anchor="rm")
    return np.asarray(image)


@lru_cache(maxsize=4)
def _font(size: int) -> ImageFont.ImageFont | ImageFont.FreeTypeFont:
    return ImageFont.load_default(size)
