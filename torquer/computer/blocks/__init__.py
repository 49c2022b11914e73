"""Plug-ins of the on-board computer: functions with named parameters and memory, compiled once."""
