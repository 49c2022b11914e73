"""What everything else rests on: conventions, specs, limits, time, random numbers, text files."""
