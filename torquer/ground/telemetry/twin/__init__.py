"""A satellite's twin: a scenario whose inertia, gain and dipole are fitted to its telemetry."""
