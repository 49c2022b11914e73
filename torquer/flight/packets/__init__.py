"""Packets between satellite and ground: one dictionary, and everything that is derived from it."""
