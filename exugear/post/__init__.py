"""Gears and built gearboxes as bodies in Exudyn's viewer and in pictures."""

import lazy_loader

#: Modules for pictures, imported on first use.
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["graphics"])
