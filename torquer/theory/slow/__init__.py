"""Slow motion: averaging, gains, charts, closed equations."""
