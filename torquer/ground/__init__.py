"""The ground: archive, commands, live telemetry in the browser."""

#: File in the folder by which commands on this machine find the server: its address and token.
SERVER = "server.json"
