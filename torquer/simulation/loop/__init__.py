"""The simulation loop and its phases."""
