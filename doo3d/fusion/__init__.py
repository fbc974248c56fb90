"""Fuse views of one scene to a point cloud."""
