"""The report on a run: panels over time, the ground track, the motion in space, one HTML page."""
