from .fields import Field, cycle_fields, plane_fields, save_vtu, solid_fields

__all__ = ["Field", "cycle_fields", "plane_fields", "save_vtu", "solid_fields"]
