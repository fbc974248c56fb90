"""Runs: every frame of a capture through the method, by this process or by workers, resumable at any moment."""
