"""Numbers derived from results and designs, before anything is drawn.

`summary` sums up a run; `attitude`, `wheels`, `control_cycle` and `series` are what it and the
pictures are computed from. `wheel_design` is the analysis of a wheel array, `field_map` and
`field_cone` are those of the geomagnetic field.
"""
