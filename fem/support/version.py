"""Version of the installed distribution, which holds `fem` and `exugear`."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("exugear")
except PackageNotFoundError:
    __version__ = "unknown: not installed"
