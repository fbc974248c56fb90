"""Compare a detection with the truth: strict score of a frame, crossings, merges and distances of nodes."""
