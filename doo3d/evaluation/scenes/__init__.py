"""Build scenes with known truth, by family and seed."""
