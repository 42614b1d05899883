"""From gear data to static transmission error maps by finite elements.

Names and modules are listed in `__init__.pyi` and imported at their first use: a script that loads a map or makes a
gear does not import scikit-fem.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
