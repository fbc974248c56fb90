"""Helpers that several readers use: images, depth frames, file lists, poses, Open3D, native output."""
