from . import iso6336

__all__ = ["iso6336"]
