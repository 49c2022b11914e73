"""Scenario files: TOML with unit-suffixed keys, presets, JSON schema."""
