"""Telemetry: pictures and page of an examination."""
