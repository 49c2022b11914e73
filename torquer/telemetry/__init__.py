"""What telemetry says about a satellite: its conventions, its motion, its parameters."""
