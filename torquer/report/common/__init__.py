"""Shared by all pictures and pages: figures, scales, colours, downsampling, HTML."""
