"""The force law of a gear mesh, from an STE map or a table."""
