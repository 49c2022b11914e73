"""Closed-form theory: gains of the laws, and later their averaged motion."""
