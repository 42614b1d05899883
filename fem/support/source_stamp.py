"""Checksum of the source of a module and of all modules that it imports from these packages."""

import ast
import sys
from functools import cache
from pathlib import Path
from zlib import crc32

from fem.support.version import __version__


@cache
def imported(source: bytes) -> tuple[str, ...]:
    """Names of all modules that a source may import."""
    names: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
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
