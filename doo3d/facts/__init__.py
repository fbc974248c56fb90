"""Facts that are made once from what was measured, and read by all stages."""
