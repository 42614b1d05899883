"""Report of a run as one HTML page and as PDF; animations, pictures and the viewer."""

import lazy_loader

#: Modules for pictures, imported on first use.
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["graphics"])
