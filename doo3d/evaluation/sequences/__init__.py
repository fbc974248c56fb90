"""Evaluate the tracking of cables in motion that are hidden at times, on sequences with known truth."""
