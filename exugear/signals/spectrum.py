"""Envelopes and their peaks; envelope of the DTE, superharmonics, rms of bearing forces."""

from exugear.signals.envelope import (
    Envelope,
    Peaks,
    bearing_force_rms,
    dte_envelope,
    envelope,
    peaks,
    superharmonics,
)
from fem.support.user_warning import warn_renamed

__all__ = ["Envelope", "Peaks", "bearing_force_rms", "dte_envelope", "envelope", "peaks", "superharmonics"]


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str):
    """Names of earlier versions."""
    if name == "Resonances":
        warn_renamed("Resonances", "Peaks")
        return Peaks
    from exugear.signals import resonances, short_time_spectra

    earlier = {"resonances": resonances, "order_spectrum": short_time_spectra, "OrderSpectrum": short_time_spectra}
    if name in earlier:
        return getattr(earlier[name], name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
