"""The option that gives a video, in the commands that move an emulated vehicle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from ident.extras import Extra, require, require_engine
from quasiomni.application import console
from quasiomni.showing import bar

if TYPE_CHECKING:
    from hil.video.film import Video  # needs the emulator, which a real vehicle's computer does not have

VideoOption = Annotated[
    Path | None,
    typer.Option("--video", help="Draw the emulated vehicle into this file when all is done: .mp4 or .gif."),
]
VideoRateOption = Annotated[
    int, typer.Option("--video-rate", min=1, max=100, help="Pictures of the video a simulated second.")
]
VIDEO_RATE: Final = 25
AT_REST: Final = "at rest"
"""Caption between two steps: booting, reading the steering at standstill."""


def plan_video(path: Path | None, rate: int, caption: str) -> Video | None:
    """The video that was asked for; what it needs is here, and its place can be written.

    Args:
        path: None for no video.
        rate: pictures a simulated second.
        caption: until the vehicle says what it is doing.

    Raises:
        UserError: an extra is missing, or the path names no video that could be written.
    """
    if path is None:
        return None
    require_engine(None, "--video")
    require(Extra.VIDEO, "--video")
    from hil.video.film import Caption, Video
    from hil.video.writing import refuse_unwritable

    refuse_unwritable(path)
    return Video(path, rate, Caption(caption))


@contextmanager
def drawing(video: Video | None) -> Iterator[Video | None]:
    """The video, drawn with a bar that says how far it is; where it is, once it is there."""
    if video is None:
        yield None
        return
    with ExitStack() as shown:
        moved: list[Callable[[int, int], None]] = []

        def draw(done: int, total: int) -> None:
            if not moved:
                moved.append(shown.enter_context(bar("drawing the video")))
            moved[0](done, total)

        yield replace(video, drawn=draw)
    if video.path.exists():
        console.print(f"The video is {video.path}.", highlight=False, soft_wrap=True)


def captioned(video: Video | None, progress: Callable[[str, int, int], None]) -> Callable[[str, int, int], None]:
    """A campaign's progress that is the video's caption, too: the step that is driven, or that there is none."""
    if video is None:
        return progress
    caption = video.caption

    def tell(step: str, done: int, total: int) -> None:
        caption.text = step if done < total else AT_REST
        progress(step, done, total)

    return tell
