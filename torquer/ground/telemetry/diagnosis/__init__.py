"""What explains |B|: rival causes scored by one likelihood, and a verdict that names its rivals."""
