"""Warnings that name the line of the user's script, whatever calls lie between."""

import sys
import warnings

#: Packages whose lines call ours in the user's name: the two packages, Exudyn's solvers, context managers.
BETWEEN = {"fem", "exugear", "exudyn", "contextlib"}


def warn_user(message: str, category: type[Warning] = UserWarning) -> None:
    """Warning at the innermost line of the user's own code."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").split(".")[0] in BETWEEN:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)


def warn_renamed(old: str, new: str) -> None:
    """DeprecationWarning that names what replaces a name of an earlier version."""
    warn_user(f"{old} is deprecated; use {new}", DeprecationWarning)
