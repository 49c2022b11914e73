"""Links by address."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping
from functools import partial
from typing import Any

from torquer.flight.link.ground_end import TcpClient, UdpClient
from torquer.flight.link.link import Link
from torquer.flight.link.screen import NewScreen
from torquer.flight.link.tcp import TcpLink
from torquer.flight.link.udp import UdpLink
from torquer.flight.packets.dictionary import Dictionary, load_dictionary
from torquer.flight.packets.frames import Direction

_FORMS = (
    "tcp:HOST:PORT, udp:HOST:PORT, can:virtual:CHANNEL, can:udp_multicast:GROUP or "
    "can:socketcan:INTERFACE"
)
_CAN = ("virtual", "udp_multicast", "socketcan")
_LAST_PORT = 2**16 - 1


def open_link(
    address: str, dictionary: Dictionary | None = None, new_screen: NewScreen | None = None
) -> Link:
    """The satellite's end of the link with this address, ready to use.

    tcp:HOST:PORT               clients connect; each gets the whole downlink
    udp:HOST:PORT               whoever has sent a datagram, even an empty one, gets the downlink
    can:virtual:CHANNEL         a bus within this process
    can:udp_multicast:GROUP     a bus of this machine; what is sent does not leave it
    can:socketcan:INTERFACE     a bus of the operating system (Linux)

    A host by its name or number, IPv6 in brackets; port 0: any free one. Only 127.0.0.1 or
    localhost is for this machine alone. `dictionary`: the packets that have identifiers of their
    own on a CAN bus [those of Chibis-M]; `new_screen`: what `screens_of` makes, so that clients get
    nothing through but whole frames [bytes as they come]. ValueError with one line if there is no
    such link.
    """
    kinds = {"tcp": TcpLink, "udp": UdpLink}
    ends = {kind: partial(end, new_screen=new_screen) for kind, end in kinds.items()}
    return _open(address, dictionary, ends, "down", new_screen)


def connect(address: str, dictionary: Dictionary | None = None) -> Link:
    """The ground's end of the link to a satellite with this address, as `open_link` has them.

    TCP: connected as soon as the satellite listens, and again after it was lost. ValueError with
    one line if there cannot be such a link.
    """
    return _open(address, dictionary, {"tcp": TcpClient, "udp": UdpClient}, "up")


def _open(
    address: str,
    dictionary: Dictionary | None,
    ends: Mapping[str, Any],
    sends: Direction,
    new_screen: NewScreen | None = None,
) -> Link:
    """The end of a link; `ends`: its class by kind; `sends`: the direction of what it sends."""
    kind, _, rest = address.partition(":")
    try:
        if kind in ends:
            return ends[kind](*_host_and_port(rest))
        interface, _, channel = rest.partition(":")
        if kind == "can" and interface in _CAN and channel:
            known = dictionary or load_dictionary("chibis_m")
            return _by_can(interface, channel, known, sends, new_screen)
    except _Wrong as error:
        raise ValueError(f"{error}; received {address!r}") from None
    except OSError as error:
        why = error.strerror or str(error)
        raise ValueError(
            f"must be an address that can be opened; received {address!r}: {why}"
        ) from None
    raise ValueError(f"must be {_FORMS}; received {address!r}")


class _Wrong(ValueError):
    """A mistake in an address, still without the address."""


def _host_and_port(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    host = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not host or (":" in host and not text.startswith("[")):
        raise _Wrong(f"must be {_FORMS}, IPv6 in brackets")
    if not (port.isascii() and port.isdecimal() and int(port) <= _LAST_PORT):
        raise _Wrong(f"port must be a whole number from 0 to {_LAST_PORT}")
    return host, int(port)


def _by_can(
    interface: str,
    channel: str,
    dictionary: Dictionary,
    sends: Direction,
    new_screen: NewScreen | None,
) -> Link:
    if interface == "udp_multicast":
        _check_group(channel)
    try:
        from torquer.flight.link.can_bus import CanLink, open_bus
    except ImportError:
        raise _Wrong("needs python-can, which `pip install 'torquer[can]'` adds") from None
    try:
        bus = open_bus(interface, channel)
    except ValueError as error:
        raise _Wrong(str(error)) from None
    return CanLink(bus, f"can:{interface}:{channel}", dictionary, sends, new_screen)


def _check_group(channel: str) -> None:
    try:
        is_group = ipaddress.ip_address(channel).is_multicast
    except ValueError:
        is_group = False
    if not is_group:
        raise _Wrong("group must be a multicast address, such as 239.74.163.2")
