"""torquer: design, analyse, simulate and fly attitude control with magnetorquers and wheels."""
__version__ = "0.1.0"
