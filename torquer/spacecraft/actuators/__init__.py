"""Coils, wheels and rotors."""
