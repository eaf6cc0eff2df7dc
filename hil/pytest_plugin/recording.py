"""What is kept of a test: a BLF recording of all frames and a timeline."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import can

from hil.pytest_plugin.timeline import timeline
from hil.pytest_plugin.world import World
from ident.errors import UserError


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
        try:
            recording.parent.mkdir(parents=True, exist_ok=True)
            with can.BLFWriter(recording) as writer:
                for frame in world.frames:
                    writer.on_message_received(frame)
            picture.write_text(timeline(world, self._title), encoding="utf-8")
        except OSError as error:
            raise UserError(
                f"{recording.parent} cannot be written to: {error.strerror}.", "Name another folder: --hil-artifacts."
            ) from error
        return {"recording": recording, "timeline": picture}
