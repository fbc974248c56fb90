"""Scenes with known truth, by family and seed."""
