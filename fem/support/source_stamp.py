"""Checksum of the source of a module and of all modules that it imports from these packages."""

import re
import sys
from functools import cache
from pathlib import Path
from zlib import crc32

from fem.support.version import __version__

#: Import statements, of several lines where names stand in parentheses.
IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+([^\n]*))", re.MULTILINE
)


@cache
def imported(source: bytes) -> tuple[str, ...]:
    """Names of all modules that a source may import, and of what it imports from them."""
    names: list[str] = []
    for module, members, modules in IMPORT.findall(source.decode()):
        names += re.findall(r"[\w.]+", modules)
        names += [module, *(f"{module}.{member}" for member in re.findall(r"\w+", members))] if module else []
    return tuple(names)


def source_stamp(module: str) -> int:
    """Checksum of a module's source and of all that it imports, from its own package and from `fem`."""
    packages = {name.split(".")[0] for name in (__name__, module)}
    sources: dict[str, bytes] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        file = getattr(sys.modules.get(name), "__file__", None)
        if file and name not in sources and name.split(".")[0] in packages:
            sources[name] = _source(Path(file))
            waiting += imported(sources[name])
    return crc32(b"".join(sources[name] for name in sorted(sources)))


def _source(file: Path) -> bytes:
    """Source of a module; where only bytecode is installed, the version of the packages instead."""
    try:
        return file.read_bytes()
    except OSError:
        return f"'{__version__}'".encode()
