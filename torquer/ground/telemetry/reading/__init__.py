"""Files of any format, by a mapping, as a session: quantities in SI over UTC."""
