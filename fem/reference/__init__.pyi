from . import dynamic, explicit, nonlinear

__all__ = ["dynamic", "explicit", "nonlinear"]
