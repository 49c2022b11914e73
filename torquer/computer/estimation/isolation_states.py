"""What a sensor is to a filter."""

#: Used, or isolated because its readings do not turn with the body, cannot be (a field of another
#: magnitude, the Sun in the umbra), contradict those of others, or because the latest one is no
#: number.
USED, STUCK, ODD, CONTRADICTS, NO_NUMBER = 0.0, 1.0, 2.0, 3.0, 4.0
