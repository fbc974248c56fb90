"""Voxels, thinned to a curve skeleton, and the paths along it."""
