"""Errors that a user can mend: each says what is wrong, where, and what to do about it."""

from __future__ import annotations

import copyreg


class UserError(Exception):
    """Something the user can mend; shown without a traceback, exit code 2.

    Args:
        what: what is wrong and where, one sentence.
        remedy: what to do about it, one sentence.
    """

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"{what} {remedy}")
        self.what = what
        self.remedy = remedy

    def __reduce__(self) -> tuple[object, ...]:
        """Whole from a worker's process: an exception is made anew from its message alone otherwise, and fails."""
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


class DataFileError(UserError):
    """A data file (vehicle, parameters, network, prototype) is missing, malformed or impossible."""


class RecordError(UserError):
    """A record violates the data contract: channel missing, NaN, non-uniform time, unknown unit."""


class BusError(UserError):
    """The CAN bus cannot be opened, or the network on it is not the one described."""


class CampaignError(UserError):
    """The campaign cannot be driven safely or a step failed while driving."""


class EstimationError(UserError):
    """The data cannot determine the parameters asked for."""
