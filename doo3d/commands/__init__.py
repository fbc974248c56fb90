"""What the commands share, and the commands of `doo3d evaluate`."""
