"""Scenario files: TOML with unit-suffixed keys, hardware presets, JSON schema."""

from torquer.scenario.load import ScenarioError, load, load_text, schema

__all__ = ["ScenarioError", "load", "load_text", "schema"]
