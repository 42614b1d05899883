"""Compilation by numba: `compiled` functions call one another; `kept` ones are called from Python and stay on disk."""

from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from zlib import crc32

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

compiled = njit


@cache
def stamp(folder: Path) -> int:
    """Of all modules in a folder that hold such functions."""
    sources = (path.read_bytes() for path in sorted(folder.glob("*.py")))
    return crc32(b"".join(source for source in sources if b"fem.compiled" in source))


class Kept(FunctionCache):
    """Numba's cache, which knows a function's own file, but not those of the functions that it calls."""

    def __init__(self, function):
        super().__init__(function)
        folder = Path(function.__code__.co_filename).parent
        self._cache_file = IndexDataCacheFile(self.cache_path, self._impl.filename_base, stamp(folder))


def kept(function, **options):
    """Compiled and, where a folder can be written, kept on disk with all that it calls, until any of that changes."""
    dispatcher = njit(function, **options)
    with suppress(RuntimeError):
        dispatcher._cache = Kept(function)
    return dispatcher


#: Sums in any order
fast = partial(kept, fastmath=True)
