"""Periodic steady states of a gearbox over the speed: all branches, their stability and their bifurcations."""
