"""The ground: archive, commands, live telemetry in the browser."""
