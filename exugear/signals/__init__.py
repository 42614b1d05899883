"""Numbers from signals: envelopes, resonances, orders."""
