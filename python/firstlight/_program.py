"""The program `firstlight`: `python -m firstlight`, or the command of that name."""

from __future__ import annotations

import sys

from . import _firstlight


def main() -> int:
    """Runs the program with the arguments of this process."""
    return _firstlight.main(["firstlight", *sys.argv[1:]])
