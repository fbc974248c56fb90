"""Follow objects through the frames of a capture."""
