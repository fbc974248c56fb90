"""Objects followed through the frames of a capture."""
