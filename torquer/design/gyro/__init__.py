"""Gains of the magneto-gyroscopic system: magnetometer, coils and a pitch wheel."""
