"""The report on a wheel design: envelopes, failures, momentum build-up, tables."""
