"""Friction between the teeth and drag of shafts and bearings, as data."""
