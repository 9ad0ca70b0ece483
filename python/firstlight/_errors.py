"""Exceptions, with the messages of the program."""

import builtins


class Error(Exception):
    """An image cannot be made or saved."""


class InputError(Error, ValueError):
    """A scene, a value or an option is wrong; the message says what, and what is expected."""


class MemoryError(Error, builtins.MemoryError):
    """There is not enough memory for an image of that size."""
