"""Sixteen members of one orbit side by side: their numbers, their laws, their flight."""
