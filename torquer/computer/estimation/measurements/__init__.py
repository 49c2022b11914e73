"""Sensors as Kalman filters take them: (z, H, R), one file a sensor.

A sensor's file has its keys, a kernel that makes a `Measurement` of a reading, along any motion,
one that makes it of the computer's latest reading and, for a direction, one for starts: all of
them declared as its `MEASURED`. The device names the file.
"""
