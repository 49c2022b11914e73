"""Kalman filters checked: consistency, observability, accuracy to be expected, smoothing."""
