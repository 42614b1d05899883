"""Two gears in mesh: path of contact, Hertz, interference, offsets, placement, position in the mesh cycle, ISO 6336."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
