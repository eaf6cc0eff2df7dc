"""From stills to a video."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager

import numpy as np
from numpy.typing import NDArray

from emulator.engine.camera import HEIGHT, WIDTH, follow
from emulator.engine.choice import PAINTERS
from emulator.engine.protocol import Painter
from emulator.prototype import Prototype
from emulator.vehicle import EmulatedVehicle
from hil.video.caption import write_caption
from hil.video.film import FilmedVehicle, Still, Video
from hil.video.writing import write_video
from ident.errors import UserError
from ident.extras import EngineName


@contextmanager
def filmed(vehicle: EmulatedVehicle, engine: EngineName, video: Video) -> Iterator[FilmedVehicle]:
    """A vehicle of which a video is written at the end, that of a drive that failed included; not of one that was
    stopped from outside.

    Args:
        vehicle: the vehicle; the caller closes it.
        engine: whose renderer draws it.
        video: that is asked for.

    Raises:
        UserError: there is nothing to draw with, said at once; or the video cannot be written.
    """
    with closing(PAINTERS[engine](vehicle.built, width=WIDTH, height=HEIGHT)) as painter:
        film = FilmedVehicle(vehicle, video.rate, video.caption)
        try:
            yield film
        except UserError:
            develop(film.stills, painter, vehicle.built.prototype, video)
            raise
        develop(film.stills, painter, vehicle.built.prototype, video)


def develop(stills: Sequence[Still], painter: Painter, prototype: Prototype, video: Video) -> None:
    """Draw stills and write them.

    Raises:
        UserError: the video cannot be written.
    """
    write_video(_pictures(stills, painter, prototype, video), video.path, video.rate)


def _pictures(
    stills: Sequence[Still], painter: Painter, prototype: Prototype, video: Video
) -> Iterator[NDArray[np.uint8]]:
    for index, still in enumerate(stills):
        video.drawn(index, len(stills))
        camera = follow(prototype, still.position, still.orientation)
        picture = painter.paint(still.position, still.orientation, still.angles, camera)
        yield write_caption(picture, still.caption, still.time)
    video.drawn(len(stills), len(stills))
