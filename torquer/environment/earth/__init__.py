"""The Earth: its rotation, its gravity, its atmosphere."""
