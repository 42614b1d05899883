"""Warnings that name the line of the user's script, whatever calls lie between."""

import contextlib
import os
import sys
import warnings
from pathlib import Path

#: Files of the two packages, and of the context managers between them, in which the cause does not lie.
INSIDE = *(f"{Path(__file__).parents[2] / name}{os.sep}" for name in ("fem", "exugear")), contextlib.__file__


def warn_user(message: str) -> None:
    """Warn at the innermost line that lies outside of fem and exugear."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(INSIDE):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, stacklevel=level)
