"""Looking at how a detection came about: explanations, stage products, the Rerun viewer, timing."""
