"""What a browser shows: the live board, the ground, and what their pages share."""
