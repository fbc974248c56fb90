"""Scenes with known truth, a renderer with a sensor model, the score, and the table of how good the detection is."""
