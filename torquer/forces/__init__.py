"""What pulls and what drags a satellite: the Earth's gravity, its turning, its atmosphere."""
