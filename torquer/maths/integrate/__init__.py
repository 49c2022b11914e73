"""Integrators: RK4 with shared environment, exact free rotation and splitting, DOP853."""
