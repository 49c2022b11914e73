"""What a scenario's author should know before the run: not errors, but likely surprises."""
