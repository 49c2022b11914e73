"""Fault campaigns: every single fault of a scenario, struck in every mode; what becomes of it."""
