"""Facts that are made once from what was measured, natively, and read by all stages."""
