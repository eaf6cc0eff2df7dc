"""Opens the page: looks whether it can be served where it was asked for, and starts the process that does."""

from __future__ import annotations

import errno
import ipaddress
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from hil.page.channel import Channel, ClosedError, make_pair
from hil.page.shown import Failed, Ready
from ident.errors import UserError
from ident.extras import Extra, require

LOOPBACK: Final = "127.0.0.1"
PORT: Final = 8080
_PROGRAM: Final = "hil.page.serving"
_PATIENCE: Final = 120.0
"""Longest wait for the process of the page [s]."""

_FAREWELL: Final = 2.0
"""Longest wait for its end [s]."""


@dataclass(frozen=True)
class Address:
    """Where the page is served: host name or address of this computer, and TCP port (0: any that is free)."""

    host: str = LOOPBACK
    port: int = PORT

    @property
    def is_loopback(self) -> bool:
        """Only programs on this computer reach it."""
        try:
            return ipaddress.ip_address(socket.gethostbyname(self.host)).is_loopback
        except OSError:
            return False

    def url(self, port: int) -> str:
        """What to open in a browser."""
        host = "localhost" if self.host in ("0.0.0.0", "::") else self.host
        return f"http://{host}:{port}"


class PageError(UserError):
    """The page cannot be served."""


def refuse_unservable(address: Address) -> None:
    """See that the page can be served, before anything else is done.

    Raises:
        UserError: the extra is missing, or the address is taken or none of this computer.
    """
    require(Extra.WEB, "--web")
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((address.host, address.port))
    except socket.gaierror as error:
        raise _no_address(address, str(error.strerror)) from error
    except OSError as error:
        raise _unusable(address, error) from error


class Page:
    """A page that is open, or opens.

    Args:
        address: where it is served.
        channel: to its process.
        process: that serves it.
    """

    def __init__(self, address: Address, channel: Channel, process: subprocess.Popen[bytes]) -> None:
        self.channel = channel
        self._address = address
        self._process = process

    def wait(self) -> str:
        """Wait until it is served; gives what to open in a browser.

        Raises:
            PageError: it cannot be.
        """
        end = time.monotonic() + _PATIENCE
        try:
            while (left := end - time.monotonic()) > 0:
                self.channel.wait(left)
                for message in self.channel.receive():
                    if isinstance(message, Ready):
                        return self._address.url(message.port)
                    if isinstance(message, Failed):
                        raise PageError(message.what, "Take another --web-port.")
        except ClosedError:
            pass
        raise PageError("The page does not come up.", "Try `python -c 'import viser'`, or go without --web.")

    def close(self) -> None:
        """End its process."""
        self.channel.close()
        try:
            self._process.wait(_FAREWELL)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


@contextmanager
def open_page(address: Address) -> Iterator[Page]:
    """A page, whose process starts now and comes up by itself; closed at the end.

    Raises:
        UserError: it cannot be served there.
    """
    refuse_unservable(address)
    ours, theirs = make_pair()
    # A program of its own: a fork would hold buses and engine open, `multiprocessing` run the caller's script again.
    with theirs:
        words = (str(theirs.fileno()), address.host, str(address.port))
        process = subprocess.Popen([sys.executable, "-P", "-m", _PROGRAM, *words], pass_fds=[theirs.fileno()])
    page = Page(address, Channel(ours), process)
    try:
        yield page
    finally:
        page.close()


def _no_address(address: Address, why: str) -> PageError:
    return PageError(
        f"The page cannot be served at {address.host}: {why}.",
        "Give an address of this computer: --web-host 127.0.0.1.",
    )


def _unusable(address: Address, error: OSError) -> PageError:
    if isinstance(error, PermissionError):
        return PageError(f"Port {address.port} is not for everybody.", "Take one above 1023: --web-port 8080.")
    if error.errno == errno.EADDRINUSE:
        return PageError(
            f"Port {address.port} of {address.host} is taken by another program.",
            "Take another, --web-port 8081, or any that is free, --web-port 0.",
        )
    return _no_address(address, error.strerror or str(error))
