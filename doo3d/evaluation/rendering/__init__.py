"""RGB-D frames of scenes: tube meshes, rays, the depth sensor's noise."""
