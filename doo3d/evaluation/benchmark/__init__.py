"""The table of the paper over frames of known truth: cases, the score of each, tables and pictures."""
