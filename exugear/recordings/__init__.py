"""Recorded signals: selection from runs, sampling over the shaft angle, levels, sound files."""
