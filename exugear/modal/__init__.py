"""Vibration modes of a loaded gearbox, or of a hand-built system with gear contacts, and their Campbell diagram."""
