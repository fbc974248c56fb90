"""Render RGB-D frames of scenes: tube meshes, rays, the noise of the depth sensor."""
