"""Frictionless contact of all tooth pairs at one position in the mesh cycle."""
