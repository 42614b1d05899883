"""Exudyn calls the compiled contacts directly, without Python in between; EXUGEAR_PORTABLE=1 switches this off."""
