"""Evaluate the detection over frames with known truth: cases, scores, tables and pictures."""
