"""The spacecraft: body, coils, sensors. Specs in edge units, kernels in SI."""
