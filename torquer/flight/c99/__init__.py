"""The on-board computer as C99: the translator of kernels, and the files that an export is."""
