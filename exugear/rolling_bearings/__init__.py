"""Rolling bearings from their inner geometry: Hertzian contacts, one energy law, statics, pressure and life."""
