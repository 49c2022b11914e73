"""Colours of all pictures."""

#: Okabe and Ito's colours, which colour-blind readers can distinguish.
ORANGE, SKY, GREEN = "#E69F00", "#56B4E9", "#009E73"
BLUE, RED, PINK = "#0072B2", "#D55E00", "#CC79A7"
#: Magnitudes; readable on light and dark backgrounds.
GREY = "#767676"
AXES = (("x", RED), ("y", GREEN), ("z", BLUE))
