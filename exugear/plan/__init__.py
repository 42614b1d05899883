"""What a scene needs: coordinates of the bodies, axes of the maps, integrator and step. No Exudyn."""
