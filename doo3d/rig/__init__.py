"""Frames of rigs: strands triangulated from a stereo pair, and views of several depth cameras fused at each time."""
