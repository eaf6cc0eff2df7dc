"""What is kept of a test: a BLF recording of all frames and a timeline."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import can

from hil.pytest_plugin.timeline import timeline
from hil.pytest_plugin.world import World
from ident.errors import UserError
from ident.writing import write_by, write_whole


class Artifacts:
    """Files of one test.

    Args:
        path: of the files, without suffix.
        title: of the timeline.
    """

    def __init__(self, path: Path, title: str) -> None:
        self._path = path
        self._title = title

    def write(self, world: World) -> Mapping[str, Path]:
        """Write recording and timeline; gives their names and paths.

        Raises:
            UserError: the folder cannot be written to.
        """
        recording = self._path.with_name(f"{self._path.name}.blf")
        picture = self._path.with_name(f"{self._path.name}.svg")

        def write_frames(path: Path) -> None:
            with can.BLFWriter(path) as writer:
                for frame in world.frames:
                    writer.on_message_received(frame)

        try:
            write_by(write_frames, recording)
            write_whole(timeline(world, self._title), picture)
        except UserError as error:
            raise UserError(error.what, "Name another folder: --hil-artifacts.") from error
        return {"recording": recording, "timeline": picture}
