"""What is bolted together: body, coils, sensors. Specs in edge units, kernels in SI."""
