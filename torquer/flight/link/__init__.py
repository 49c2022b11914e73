"""Links between a satellite and its ground: TCP, UDP, CAN."""

from torquer.flight.link.address import connect as connect, open_link as open_link
from torquer.flight.link.link import Link as Link
from torquer.flight.link.screen import screens_of as screens_of
