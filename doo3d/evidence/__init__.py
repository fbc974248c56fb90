"""Evidence: models learned once from a frame, that answer questions of the stages in log-odds."""
