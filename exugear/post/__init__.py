"""Results: spectra, plots, pictures of gears."""

import lazy_loader

#: Modules that only pictures need, imported when they are first asked for.
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["graphics", "plots", "stress_plots"])
