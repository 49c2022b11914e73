"""A small satellite with a ground of its own, and the console in a wide and a narrow window."""

import pytest
from ground_flight import serving, table, until
from small_satellite import received, small_satellite
from watched_page import browser_context, watched_page


@pytest.fixture(scope="module")
def satellite():
    with small_satellite() as made:
        yield made


@pytest.fixture(scope="module")
def client(satellite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ground")
    with serving(folder, sat=table(satellite.address, in_scenario=None)) as made:
        until(lambda: received(made))
        yield made


@pytest.fixture(scope="module", params=[1280, 400])
def context(request):
    with browser_context(request.param, 800, request.module.PATIENCE_MS) as context:
        context.width = request.param
        yield context


@pytest.fixture
def page(context):
    with watched_page(context, "400 (Bad Request)") as page:
        yield page
