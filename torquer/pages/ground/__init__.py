"""The ground's page and its server."""
