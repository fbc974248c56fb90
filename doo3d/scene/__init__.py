"""What was captured, and what a camera says about positions, paths and ends."""
