"""Vectors, rotations and frames: pure kernels on tuples."""
