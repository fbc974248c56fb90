"""Evaluate the detection: scenes with known truth, a renderer with sensor models, scores, and tables of results."""
