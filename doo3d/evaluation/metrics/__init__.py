"""What a detection is worth beside the truth: the strict score, crossings, merges, node distances."""
