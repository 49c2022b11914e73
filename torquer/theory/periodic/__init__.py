"""Linear and forced systems with periodic coefficients."""
