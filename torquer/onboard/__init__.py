"""Flight software around the compiled computer: modules, queues, clock, memory, error log."""
