"""Hot loops, compiled with numba: free functions on plain arrays."""
