"""The macro-geometry of one gear: material, tooth root, tooth profile, dimensions to measure (ISO 21771)."""
