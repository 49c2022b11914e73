"""What all pictures and pages share: figures, scales, colours, downsampling, HTML."""
