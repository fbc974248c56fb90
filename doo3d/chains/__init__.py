"""Chains of equal segments: fitted, pruned, filled and refined."""
