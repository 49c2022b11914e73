"""The motion from one event of the loop to the next."""
