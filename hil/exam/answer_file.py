"""The answer of an exam, and whatever else tells of it: encrypted with a key, or readable in a set to tune on.

AES-256-GCM with a key that is derived for the exam; the manifest is authenticated with every text, so that neither can
be changed without notice. What is encrypted is padded: its length tells nothing but the number of cases.
"""

from __future__ import annotations

import base64
import hashlib
import json
import secrets
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from hil.exam.cases import Case, case_from_json
from hil.exam.folder import Exam, ExamFolder, read_exam
from hil.exam.key import Key, read_key
from ident.errors import UserError

SCHEMA: Final = "quasiomni.exam.truth/1"
CIPHER: Final = "AES-256-GCM"

NONCE: Final = 12
"""Length of a nonce [bytes], NIST SP 800-38D, section 5.2.1.1."""

PADDING: Final = 1024
"""A case takes no more [bytes]; texts are filled up to a multiple of it."""

_ANSWER: Final = "answer"


def answer_text(cases: Sequence[Case], exam: Exam, key: Key | None) -> str:
    """The file of the answer."""
    return _closed({"cases": [case.as_json() for case in cases]}, exam, _ANSWER, key, PADDING * len(cases))


def undriven_text(identifier: str, reason: str, exam: Exam, key: Key | None) -> str:
    """The file that says why a case could not be driven."""
    return _closed({"reason": reason}, exam, identifier, key, PADDING)


def answer_hash(text: str) -> str:
    """What the manifest holds of the answer."""
    return hashlib.sha256(text.encode()).hexdigest()


def key_of_exam(folder: ExamFolder, exam: Exam, path: Path | None) -> Key | None:
    """The key of an exam; None where it is not sealed.

    Raises:
        UserError: the exam is sealed and no key is named, or it is not this one's.
    """
    if not exam.sealed:
        return None
    if path is None:
        raise UserError(
            f"{folder.path} is sealed, and its answer opens with its key alone.",
            "Name the key that it was sealed with: --key FILE.",
        )
    key = read_key(path, folder.path)
    if key.fingerprint(bytes.fromhex(exam.salt)) != exam.key:
        raise UserError(f"{path} is not the key of {folder.path}.", "Name the key that it was sealed with (--key).")
    return key


def own_key(folder: ExamFolder, exam: Exam, paths: Sequence[Path]) -> Path | None:
    """The key of an exam among several; the first where none is, for whoever refuses it; None where none is given.

    Raises:
        UserError: one of them is no key.
    """
    if not exam.sealed or not paths:
        return None
    salt = bytes.fromhex(exam.salt)
    return next((path for path in paths if read_key(path, folder.path).fingerprint(salt) == exam.key), paths[0])


def open_answer(folder: ExamFolder, exam: Exam, key: Key | None) -> list[Case]:
    """The cases of an exam, from its answer.

    Args:
        folder, exam: which.
        key: of the exam (`key_of_exam`).

    Raises:
        UserError: there is no answer, it is not the one that was sealed, or the manifest is not.
    """
    try:
        text = folder.answer.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{folder.answer} cannot be read: {error}.", "Seal the exam again.") from error
    if answer_hash(text) != exam.answer_hash:
        raise UserError(f"{folder.answer} is not the answer that was sealed.", "Restore it, or seal the exam again.")
    content = _opened(json.loads(text), exam, _ANSWER, key, folder)
    return [case_from_json(entry) for entry in content["cases"]]


def open_cases(folder: ExamFolder, key: Path | None) -> list[Case]:
    """The cases of the exam in a folder; `key` is the file that it was sealed with, None where it is not sealed.

    Raises:
        UserError: there is no exam, the key is missing or another one, or something was changed.
    """
    exam = read_exam(folder)
    return open_answer(folder, exam, key_of_exam(folder, exam, key))


def _closed(content: dict[str, Any], exam: Exam, what: str, key: Key | None, length: int) -> str:
    if key is None:
        return json.dumps({"schema": SCHEMA, "cipher": None, **content}, indent=1) + "\n"
    from cryptography.hazmat.primitives.ciphers.aead import AESGCM

    plain = json.dumps(content).encode()
    filled = plain.ljust(max(length, -(-len(plain) // PADDING) * PADDING))
    nonce = secrets.token_bytes(NONCE)
    sealed = AESGCM(_cipher_key(exam, key)).encrypt(nonce, filled, exam.context(what))
    envelope = {"nonce": nonce.hex(), "content": base64.b64encode(sealed).decode()}
    return json.dumps({"schema": SCHEMA, "cipher": CIPHER, **envelope}, indent=1) + "\n"


def _opened(envelope: dict[str, Any], exam: Exam, what: str, key: Key | None, folder: ExamFolder) -> dict[str, Any]:
    if key is None:
        return envelope
    from cryptography.exceptions import InvalidTag
    from cryptography.hazmat.primitives.ciphers.aead import AESGCM

    nonce, sealed = bytes.fromhex(envelope["nonce"]), base64.b64decode(envelope["content"])
    try:
        plain = AESGCM(_cipher_key(exam, key)).decrypt(nonce, sealed, exam.context(what))
    except InvalidTag as error:
        raise UserError(
            f"{folder.manifest} is not the one that {folder.answer} was sealed with.", "Restore both of them."
        ) from error
    content: dict[str, Any] = json.loads(plain)
    return content


def _cipher_key(exam: Exam, key: Key) -> bytes:
    return key.derive(bytes.fromhex(exam.salt), "answer")
