"""The process of the page: takes what the loop has seen, draws the newest of it, and hands on what people ask."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import signal
import socket
import sys
import time
from collections.abc import Callable
from typing import Final

import viser

from hil.page.channel import Channel, ClosedError
from hil.page.panel import Panel
from hil.page.scene import Scene
from hil.page.shown import Asked, Failed, Ready, Sketch, Snapshot, Told

_POLITENESS: Final = 5
"""By how much the page steps back behind the loop (niceness)."""

_PATIENCE: Final = 0.1
"""Longest wait for something new [s]."""

_WORDS_PERIOD: Final = 0.2
"""Between two drawings of tables and curves [s]."""


def serve(channel: Channel, host: str, port: int) -> None:
    """Serve until the loop has gone."""
    # Ctrl-C is for the loop, whose end is the end of this.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.nice(_POLITENESS)
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
    with contextlib.redirect_stdout(None), contextlib.suppress(ClosedError):
        server = viser.ViserServer(host, port, verbose=False)
        if port not in (0, server.get_port()):
            channel.send(Failed(f"Port {port} of {host} has just been taken by another program."))
            return
        # A tunnel to the outside is nothing that a page on this computer may open, whoever asks.
        server.__dict__["request_share_url"] = lambda *_, **__: None
        channel.send(Ready(server.get_port()))
        try:
            Drawing(server, channel).run()
        finally:
            server.stop()


class Drawing:
    """Draws what comes.

    Args:
        server: to draw on.
        channel: to the loop.
        monotonic: [s].
    """

    def __init__(
        self, server: viser.ViserServer, channel: Channel, monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        self._server = server
        self._channel = channel
        self._monotonic = monotonic
        self._asked: queue.SimpleQueue[Asked] = queue.SimpleQueue()
        self._scene: Scene | None = None
        self._panel: Panel | None = None
        self._next_words = 0.0

    def run(self) -> None:
        """Go on until the loop has gone.

        Raises:
            ClosedError: it has.
        """
        while True:
            self._channel.wait(_PATIENCE)
            while not self._asked.empty():
                self._channel.send(self._asked.get())
            self._take()

    def _take(self) -> None:
        newest = None
        for message in self._channel.receive():
            if isinstance(message, Sketch):
                self._scene = Scene(self._server, message)
                self._panel = Panel(self._server, message, self._scene, self._asked.put)
            elif isinstance(message, Snapshot) and self._panel is not None:
                newest = message
                self._panel.take(message)
            elif isinstance(message, Told) and self._panel is not None:
                self._panel.tell(message)
        if newest is not None:
            self._draw(newest)

    def _draw(self, snapshot: Snapshot) -> None:
        assert self._scene is not None
        assert self._panel is not None
        with self._server.atomic():
            self._scene.draw(snapshot)
        now = self._monotonic()
        if now >= self._next_words:
            self._next_words = now + _WORDS_PERIOD
            self._panel.draw(snapshot)
            self._scene.label(snapshot)
            self._scene.draw_path()


if __name__ == "__main__":
    serve(Channel(socket.socket(fileno=int(sys.argv[1]))), sys.argv[2], int(sys.argv[3]))
