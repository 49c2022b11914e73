"""Packets between satellite and ground: one dictionary, and all that follows from it."""
