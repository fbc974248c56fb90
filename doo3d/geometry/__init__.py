"""Geometry that several stages share: polylines, arcs, equal segments, masks, sparse grids, intersections."""
