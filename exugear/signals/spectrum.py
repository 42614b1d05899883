"""Envelopes, peaks and order spectra of arrays; envelope of the DTE, superharmonics, rms of bearing forces."""

from exugear.signals.envelope import Envelope, envelope
from exugear.signals.order_spectrum import OrderSpectrum, order_spectrum
from exugear.signals.resonances import Resonances, resonances, superharmonics
from exugear.signals.run_envelopes import bearing_force_rms, dte_envelope

__all__ = [
    "Envelope",
    "OrderSpectrum",
    "Resonances",
    "bearing_force_rms",
    "dte_envelope",
    "envelope",
    "order_spectrum",
    "resonances",
    "superharmonics",
]
