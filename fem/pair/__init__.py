"""Two gears in mesh: centre distance, interference, offsets, position in the mesh cycle, stiffness by ISO 6336."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
