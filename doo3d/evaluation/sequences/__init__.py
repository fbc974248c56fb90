"""Sequences with known truth: cables in motion, hidden at times, and how well they are followed."""
