"""Measure a detection against the truth: the strict score of a frame, its crossings, merges and node distances."""
