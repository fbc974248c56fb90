"""Scenes of known truth by family and seed."""
