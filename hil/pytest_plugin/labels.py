"""Labels in a picture: how wide a text can be in whatever font it is shown, and where it finds room."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

_CLASSES: Final[Mapping[float, str]] = {
    0.42: " !\"'(),-./:;[\\]`fijlrtIJ|",
    0.80: "ABCDEFGHKLNOPQRSTUVXYZ&",
    1.04: "mwMW%@#+<=>^~",
}
_WIDTHS: Final = {letter: width for width, letters in _CLASSES.items() for letter in letters}
_OTHER: Final = 0.70
"""Of letters and digits: DejaVu Sans and Verdana, the widest of the usual fonts, have no more."""
_FOREIGN: Final = 1.3
_BOLD: Final = 1.15
_MORE: Final = "…"
_REPLACED: Final = "?"


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Width that a text has at most [px] in a font of this size [px]."""
    widths = (_WIDTHS.get(letter, _OTHER if letter.isascii() else _FOREIGN) for letter in text)
    return sum(widths) * size * (_BOLD if bold else 1.0)


def printable(text: str) -> str:
    """The text without what XML cannot hold or no font has a width for: control characters become question marks."""
    return "".join(_REPLACED if unicodedata.category(letter)[0] == "C" else letter for letter in text)


def shortened(text: str, room: float, size: float, bold: bool = False) -> str:
    """As much of a text as `room` [px] holds, an ellipsis behind it where it is not all; empty where nothing fits."""
    if text_width(text, size, bold) <= room:
        return text
    kept = len(text)
    while kept and text_width(text[:kept].rstrip() + _MORE, size, bold) > room:
        kept -= 1
    return text[:kept].rstrip() + _MORE if kept else ""


def wrapped(text: str, room: float, size: float, lines: int, bold: bool = False) -> list[str]:
    """A text in at most so many lines of `room` [px]; words that are longer than a line are broken.

    The last line ends in an ellipsis where there would be more.
    """
    found: list[str] = []
    rest = text.strip()
    while rest and len(found) < lines - 1:
        cut = _line_end(rest, room, size, bold)
        found.append(rest[:cut].rstrip())
        rest = rest[cut:].lstrip()
    return [*found, shortened(rest, room, size, bold)] if rest else found


def _line_end(text: str, room: float, size: float, bold: bool) -> int:
    end = len(text)
    while end > 1 and text_width(text[:end], size, bold) > room:
        end -= 1
    if end == len(text):
        return end
    space = text.rfind(" ", 0, end + 1)
    return space if space > 0 else end


@dataclass
class Shelves:
    """Rows of a picture that fill up from the top, nothing over anything else.

    Attributes:
        most: rows that there are at most.
        gap: between neighbours [px].
    """

    most: int
    gap: float
    _rows: list[list[tuple[float, float]]] = field(default_factory=list)

    @property
    def used(self) -> int:
        """Rows with something in them."""
        return len(self._rows)

    def place(self, begin: float, end: float) -> int | None:
        """The row in which `begin` to `end` [px] is free, and is taken now; None where no row has room."""
        for number, taken in enumerate(self._rows):
            if all(end + self.gap <= other_begin or other_end + self.gap <= begin for other_begin, other_end in taken):
                taken.append((begin, end))
                return number
        if len(self._rows) == self.most:
            return None
        self._rows.append([(begin, end)])
        return len(self._rows) - 1
