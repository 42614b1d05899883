"""Stress fields of loaded gears; root stress, load distribution and load factors over the mesh cycle."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
