"""Threads take turns with a system: a second caller waits until the first has finished.

A run changes what its system and its contacts remember, and Exudyn's systems are not made for two threads: without
turns results are wrong, or the process ends. Different systems do not wait for each other.
"""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from threading import RLock
from typing import TypeVar, cast
from weakref import WeakKeyDictionary

Verb = TypeVar("Verb", bound=Callable)
_NEW_TURN = RLock()
_TURNS: WeakKeyDictionary = WeakKeyDictionary()


def turn_with(mbs):
    """The lock of an Exudyn system, as context; the thread that holds it may take it again."""
    with _NEW_TURN:
        return _TURNS.setdefault(mbs, RLock())


def in_turn(verb: Verb) -> Verb:
    """Decorator of a function whose first argument is a model or an Exudyn system: threads take turns with it.

    It stands behind `checked`, which refuses other arguments.
    """
    first = next(iter(signature(verb).parameters))

    @wraps(verb)
    def waiting(*args, **kwargs):
        model = args[0] if args else kwargs[first]
        with turn_with(getattr(model, "bare_mbs", model)):
            return verb(*args, **kwargs)

    return cast(Verb, waiting)
