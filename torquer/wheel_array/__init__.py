"""Arrays of reaction wheels: what momentum and torque they reach, and how to share a demand.

A layout is a `WheelArray` (axes and limits). The set of momentum vectors that it can hold is a
zonotope, an `Envelope`. Axes and vectors are in the body frame. An array that lost wheels is the
same array with limits of zero.
"""
