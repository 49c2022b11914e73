"""Colours of all pictures."""

#: Okabe and Ito's colours, which colour-blind readers can distinguish.
ORANGE, SKY, GREEN = "#E69F00", "#56B4E9", "#009E73"
BLUE, RED, PINK = "#0072B2", "#D55E00", "#CC79A7"
#: Magnitudes; readable on light and dark backgrounds.
GREY = "#767676"
#: Values of either sign, from below zero to above, pale at zero.
SIGNED = ("#2f5d8c", "#8fb3cf", "#f7f5ef", "#dba58a", "#9c4a2f")
#: Ground of a map where something is unstable.
UNSTABLE = "#f3d3cf"
#: Colours of several curves, and of several bars or runs.
CURVES = (BLUE, RED, GREEN, ORANGE, SKY, PINK)
RUNS = (BLUE, ORANGE, GREEN, PINK, SKY, RED)
AXES = (("x", RED), ("y", GREEN), ("z", BLUE))


def curve_colour(number: int) -> str:
    """The colour of a curve by its number, from 0; the seventh has that of the first."""
    return CURVES[number % len(CURVES)]
