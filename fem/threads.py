"""Dense algebra on one thread: more cost more than they give on matrices of this size, most of all side by side."""

from functools import cache

from threadpoolctl import ThreadpoolController


def one_thread():
    """Context in which matrix products and factorizations take one thread."""
    return _threads().limit(limits=1)


@cache
def _threads() -> ThreadpoolController:
    """The thread pools of this process, which take long to find."""
    return ThreadpoolController()
