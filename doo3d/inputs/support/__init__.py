"""Provide helpers of several readers: images, depth frames, file lists, poses, Open3D, native output."""
