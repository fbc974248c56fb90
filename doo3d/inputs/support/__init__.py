"""What the readers share: images, depth frames, file lists, Open3D, native output."""
