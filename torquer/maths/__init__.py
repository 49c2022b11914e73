"""Vectors, rotations, frames and integrators."""
