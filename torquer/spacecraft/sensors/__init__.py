"""Sensors, one file each: what they read, and with which errors."""
