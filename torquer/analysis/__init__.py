"""Numbers derived from results and designs, before anything is drawn.

`summary` sums up a run; `attitude`, `wheels`, `control_cycle` and `series` are what it and the
pictures are computed from. `torquer.analysis.field` answers questions about the geomagnetic field.
"""
