"""Contacts that Exudyn calls without Python: a hack that is tried before use, and kept in this folder."""
