"""Housings and carriers: a mesh reduced to the seats of bearings, its vibration and radiated sound power."""
