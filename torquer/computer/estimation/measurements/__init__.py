"""Sensors as Kalman filters take them: (z, H, R), one file a sensor.

A sensor's file has a kernel that makes a `Measurement` of a reading, along any motion, and one that
makes it of the computer's latest reading. Adding a sensor is such a file, its variance in
`Sensing`, its lines in `torquer.computer.estimation.kalman` and, for a direction, in
`torquer.computer.estimation.directions`.
"""
