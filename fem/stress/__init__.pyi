from .fields import Field, plane_fields, save_vtu, solid_fields

__all__ = ["Field", "plane_fields", "save_vtu", "solid_fields"]
