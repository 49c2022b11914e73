"""Modes as data: what is done when, and what leads from one state to another."""
