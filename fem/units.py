"""Units as plain numbers: write ``3*mm`` or ``20*deg`` at the edge, SI and radians inside."""

from math import pi as _pi

mm = 1e-3
um = 1e-6
deg = _pi / 180
rpm = 2 * _pi / 60
MPa = 1e6
GPa = 1e9

__all__ = ["GPa", "MPa", "deg", "mm", "rpm", "um"]


def __dir__() -> list[str]:
    return __all__
