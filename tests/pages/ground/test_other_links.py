"""A satellite by UDP, whose datagrams come twice and overtake each other; one that starts again."""

import pytest
from ground_flight import serving, table, until
from small_satellite import command, received, small_satellite
from udp_relay import UdpRelay

pytest.importorskip("uvicorn")


@pytest.fixture
def relay(request):
    """A network with such shares of doubled and late datagrams, and the satellite behind it."""
    with small_satellite(address="udp:127.0.0.1:0") as satellite:
        made = UdpRelay(satellite.address, *request.param)
        made.satellite = satellite
        yield made
        made.close()


@pytest.mark.parametrize("relay", [(0.0, 0.3), (0.3, 0.0), (0.3, 0.3)], indirect=True)
def test_each_row_is_there_once_and_each_command_is_obeyed_once(tmp_path, relay):
    with serving(tmp_path, sat=table(relay.address, in_scenario=None)) as client:
        first = int(until(lambda: received(client))[0])
        assert [command(client) for _ in range(5)] == 5 * ["executed"]
        last = relay.satellite.sent + 40
        until(lambda: last in received(client))
        found = received(client)
        # whoever was overtaken by the first of all came before the count began
        wanted = set(range(first + 3, last - 3))
        assert len(found) == len(set(found)) and wanted <= set(found)
        texts = client.texts("sat")
    assert relay.satellite.obeyed == 5 * ["get_parameter"]
    assert not any("counts from the beginning" in text or "rejected" in text for text in texts)


@pytest.mark.parametrize("relay", [(0.0, 0.0)], indirect=True)
def test_a_satellite_that_starts_again_is_received_and_commanded(tmp_path, relay):
    with serving(tmp_path, sat=table(relay.address, in_scenario=None)) as client:
        until(lambda: received(client))
        relay.satellite.close()
        with small_satellite(address="udp:127.0.0.1:0") as again:
            again.sent = 1000  # its counters begin again, its clock has gone on
            relay.move(again.address)
            until(lambda: 1020 in received(client))
            assert command(client) == "executed"
            assert sum("counts from the beginning" in text for text in client.texts("sat")) == 1
            assert again.obeyed == ["get_parameter"]


def test_the_same_on_a_bus(tmp_path):
    pytest.importorskip("can")
    bus = "can:virtual:starts_again"
    with serving(tmp_path, sat=table(bus, in_scenario=None)) as client:
        for first in (0, 1000):
            with small_satellite(address=bus) as satellite:
                satellite.sent = first
                until(lambda number=first + 20: number in received(client))
                assert command(client) == "executed"
                assert satellite.obeyed == ["get_parameter"]
