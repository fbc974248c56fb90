"""Frames of one capture combined: chains tracked over time, and views of an object at rest fused to one cloud."""
