"""A pointing budget by linear theory: causes, their effect on a held attitude, statistics.

`causes` has what a scenario gives and how each is switched off; `setting` the closed loop along the
flight; `predicted` what each cause does to it; `statistics` the errors of the field's standards.
"""
