"""From a scenario to a run and back: preparing, running, stopping, resuming."""
