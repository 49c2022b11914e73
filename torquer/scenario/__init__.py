"""Scenario files: TOML with unit-suffixed keys, hardware presets, JSON schema."""
