"""From gear data to static transmission error maps by finite elements.

Names and modules are listed in `__init__.pyi` and imported when they are first asked for: who loads a map or writes a
gear down does not wait for scikit-fem.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
