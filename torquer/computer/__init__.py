"""The on-board computer: its interface, plug-ins, estimators, laws, modes and control step."""
