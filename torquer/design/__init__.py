"""Design: gains, coils, wheels, benches; a request and its answer."""
