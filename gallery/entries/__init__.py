"""One file per entry: `ENTRY`, and the function that computes it through the public names."""
