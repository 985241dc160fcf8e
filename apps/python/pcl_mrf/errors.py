# SPDX-License-Identifier: BSD-3-Clause
"""What goes wrong, as types: each is also what Python itself would raise."""


class Error(Exception):
    """Base of all errors of a reconstruction; its report tells what was done so far, or is None."""

    def __init__(self, message, report=None):
        super().__init__(message)
        self.report = report


class InvalidInput(Error, ValueError):
    """The arrays cannot be reconstructed: of another shape or length, too few points, no surface in them."""


class InvalidOption(Error, ValueError):
    """An option has a value that it does not take."""


class ResourceLimit(Error, MemoryError):
    """The memory would not suffice; the message names the voxel size that would fit."""


class SolverFailure(Error, ArithmeticError):
    """A solver broke down."""


class Cancelled(Error):
    """The callable of progress returned False."""


class FileError(Error, OSError):
    """A file cannot be written."""


class InternalError(Error, RuntimeError):
    """An error that is nobody's but the library's own."""


BY_STATUS = {
    "invalid input": InvalidInput,
    "invalid option": InvalidOption,
    "resource limit": ResourceLimit,
    "solver failure": SolverFailure,
    "cancelled": Cancelled,
}
