"""A mapping proposed for a file: readings that are tried, and why one was taken."""
