"""Provide tools for a capture: tune, explain, bench, compare, view."""
