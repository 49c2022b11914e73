"""A satellite on its orbit in averaged motion: its case, the equations as text, the results."""
