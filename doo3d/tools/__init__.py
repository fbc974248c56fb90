"""What helps with a capture: tune, explain, bench, compare, view."""
