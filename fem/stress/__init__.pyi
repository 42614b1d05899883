from .cycle_fields import cycle_fields
from .fields import Field, plane_fields, save_vtu, solid_fields

__all__ = ["Field", "cycle_fields", "plane_fields", "save_vtu", "solid_fields"]
