"""Evaluate the 2-D mode on public photographs with instance labels."""
