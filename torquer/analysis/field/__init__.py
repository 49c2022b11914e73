"""The geomagnetic field mapped and drawn: cones, lines, maps."""
