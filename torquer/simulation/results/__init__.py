"""The result of a run: its variables, its data set, its files."""
