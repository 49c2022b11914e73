"""Theory that only published figures need."""
