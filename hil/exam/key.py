"""The key of a sealed exam: a secret that its cases are drawn from and its answers are sealed with.

It is a text file outside the exam's folder, readable to its owner alone. Everything that is used is derived from it and
from the exam's salt by HKDF (RFC 5869), so one key may serve several exams, and no derived value tells another.
"""

from __future__ import annotations

import os
import secrets
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from ident.errors import UserError
from ident.extras import Extra, require

HEADER: Final = "quasiomni.exam.key/1"

SECRET: Final = 32
"""Length of the secret [bytes]."""

_COMMENT: Final = "# Draws the cases and opens the answers of an exam. Keep it from whoever diagnoses."


@dataclass(frozen=True)
class Key:
    """A secret.

    Attributes:
        path: where it was read, for messages.
        secret: SECRET bytes, never shown.
    """

    path: Path
    secret: bytes = field(repr=False)

    def derive(self, salt: bytes, purpose: str, length: int = SECRET) -> bytes:
        """Bytes for one purpose in the exam of a salt."""
        require(Extra.EXAM, "A sealed exam")
        from cryptography.hazmat.primitives.hashes import SHA256
        from cryptography.hazmat.primitives.kdf.hkdf import HKDF

        return HKDF(SHA256(), length, salt, f"quasiomni.exam {purpose}".encode()).derive(self.secret)

    def number(self, salt: bytes, purpose: str) -> int:
        """A seed of 128 bits for one purpose: too many to be tried."""
        return int.from_bytes(self.derive(salt, purpose, 16))

    def fingerprint(self, salt: bytes) -> str:
        """By which an exam knows its key."""
        return self.derive(salt, "fingerprint", 8).hex()


def read_key(path: Path, folder: Path) -> Key:
    """The key of a file.

    Args:
        path: of the key.
        folder: of the exam, in which no key may lie.

    Raises:
        UserError: it cannot be read, is no key, or lies in the exam's folder.
    """
    refuse_inside(path, folder)
    try:
        words = path.read_text(encoding="utf-8").split("\n")[-2].split()
        header, secret = words[0], bytes.fromhex(words[1])
    except OSError as error:
        raise UserError(
            f"The key {path} cannot be read: {error.strerror}.", "Name the key that the exam was sealed with (--key)."
        ) from error
    except (ValueError, IndexError):
        header, secret = "", b""
    if header != HEADER or len(secret) != SECRET:
        raise UserError(f"{path} is no key of an exam.", "Name the key that the exam was sealed with (--key).")
    return Key(path, secret)


def make_key(path: Path, folder: Path) -> Key:
    """The key of a file, with a fresh secret where there is no such file; what exists is never overwritten.

    Raises:
        UserError: it cannot be read or written, is no key, or lies in the exam's folder.
    """
    refuse_inside(path, folder)
    content = f"{_COMMENT}\n{HEADER} {secrets.token_hex(SECRET)}\n"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
    except FileExistsError:
        pass
    except OSError as error:
        raise UserError(
            f"The key {path} cannot be written: {error.strerror}.", "Name another place (--key)."
        ) from error
    return read_key(path, folder)


def refuse_inside(path: Path, folder: Path) -> None:
    """Refuse a key in the folder that is handed to whoever diagnoses.

    Raises:
        UserError: it lies there.
    """
    if path.resolve().is_relative_to(folder.resolve()):
        raise UserError(
            f"The key {path} lies in the exam's folder {folder}.", "Keep it elsewhere, out of reach of who diagnoses."
        )
