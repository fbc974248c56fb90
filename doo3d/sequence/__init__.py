"""Combine the frames of one capture: track chains, find the same objects in all frames, and fuse views of an object at rest."""
