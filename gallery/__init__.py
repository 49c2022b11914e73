"""The reproduction gallery: each published figure and table recomputed and compared.

`catalogue` lists what the sources publish, `entry` says what an entry is, `lookup` finds the
entries, one file each in `entries/`; `runs` computes them and `pages` writes docs/gallery.
"""
