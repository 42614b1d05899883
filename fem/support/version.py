"""Version of what is installed: that of the one distribution of `fem` and `exugear`."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("exugear")
except PackageNotFoundError:
    __version__ = "unknown: not installed"
