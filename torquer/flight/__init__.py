"""Flight software: packets, links, the software around the computer, and its C99."""
