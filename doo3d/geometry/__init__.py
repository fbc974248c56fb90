"""Compute with polylines, arcs, equal segments, masks, grids and projections."""
