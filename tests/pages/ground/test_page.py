"""The page in a browser: a satellite that flies is seen and commanded."""

import io

import matplotlib.image
import pytest
from watched_page import CHROMIUM, browser_context, watched_page

from torquer.compile import engine

sync_api = pytest.importorskip("playwright.sync_api")
pytest.importorskip("uvicorn")
pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium"),
]

#: Far longer than anything here takes: only a failure waits so long [ms].
PATIENCE_MS = 40_000


@pytest.fixture(scope="module")
def ground(tmp_path_factory):
    from ground_flight import serving_slowly

    with serving_slowly(tmp_path_factory.mktemp("ground")) as client:
        yield client


@pytest.fixture(scope="module")
def context(ground):
    with browser_context(1400, 850, PATIENCE_MS) as context:
        yield context


@pytest.fixture
def page(context, ground):
    """A new page; at the end it must have asked nobody but its server, without errors."""
    with watched_page(context, "400 (Bad Request)") as page:
        yield page


@pytest.fixture(scope="module")
def overview(context, ground):
    """The overview, for the tests that only look."""
    with watched_page(context, "400 (Bad Request)") as page:
        yield opened(page, ground)


@pytest.fixture(scope="module")
def commanding(context, ground):
    """The view of commands."""
    with watched_page(context, "400 (Bad Request)") as page:
        yield opened(page, ground, "commands")


def opened(page, ground, view=None):
    """The page, opened at a view of the satellite, by default at the overview."""
    place = f"#/browse/torquer:chibis/torquer:chibis.view.{view}?hideInspector=true" if view else ""
    page.goto(f"{ground.base}/?token={ground.token}&measure{place}")
    return page


def send(page, command, **values):
    """Fill the form of a command and send it."""
    page.locator(f"button[data-command={command}]").click()
    for name, value in values.items():
        field = page.locator(f".t-form [name={name}]")
        is_choice = field.evaluate("element => element.tagName === 'SELECT'")
        (field.select_option if is_choice else field.fill)(value)
    page.locator(".t-send").click()


def test_points_are_drawn(overview):
    overview.wait_for_function(
        "document.querySelector('.gl-plot-tick') && window.torquer?.latency.length"
    )


def test_plots_do_without_webgl_where_software_draws_it(overview):
    overview.locator(".gl-plot-tick").first.wait_for()
    renderer = overview.evaluate("""() => {
      const gl = document.createElement("canvas").getContext("webgl");
      const about = gl?.getExtension("WEBGL_debug_renderer_info");
      return gl ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "";
    }""")
    plots = overview.locator(".js-main-canvas")
    in_2d = plots.evaluate_all("each => each.map((canvas) => canvas.getContext('2d') !== null)")
    assert in_2d == ["SwiftShader" in renderer or not renderer] * 3


def test_the_overview_shows_link_values_and_log(overview):
    line = overview.locator(".t-link[data-state=connected]")
    sync_api.expect(line).to_contain_text("link up")
    sync_api.expect(line).to_contain_text(" frames")
    sync_api.expect(line).not_to_contain_text("rejected")  # none was
    sync_api.expect(overview.locator(".t-values__head")).to_contain_text("authentic")
    sync_api.expect(overview.locator(".t-log")).to_contain_text("link found")
    svr_mode = overview.locator(".t-values tr", has_text="svr_mode")
    sync_api.expect(svr_mode).to_contain_text("AUTOMATIC")


def test_commands_are_executed_refused_and_corrected(commanding):
    page = commanding
    send(page, "report_status", module_id="2")
    page.locator("tr[data-command=report_status][data-state=executed]").first.wait_for()
    send(page, "report_status", module_id="99")
    refused = page.locator("tr[data-command=report_status][data-state=refused]").first
    sync_api.expect(refused).to_contain_text("refused: a value out of its range")
    send(page, "report_status", module_id="256")
    sync_api.expect(page.locator(".t-form .t-failure")).to_contain_text("from 0 to 255")


def test_the_present_state_is_lit_in_the_diagram(commanding):
    page = commanding
    send(page, "automatic", on="OFF")
    page.locator("tr[data-command=automatic][data-state=executed]").first.wait_for()
    send(page, "set_mode", region="stabilisation", state="acquisition")
    page.locator("tr[data-command=set_mode][data-state=executed]").first.wait_for()
    page.get_by_role("treeitem").filter(has_text="Modes").first.click()
    lit = page.locator("[data-region=stabilisation].is-present")
    sync_api.expect(lit).to_have_attribute("data-state", "acquisition")
    assert lit.count() == 1
    line = page.locator(".t-regions [data-region=stabilisation]")
    sync_api.expect(line).to_contain_text("acquisition")


def test_the_attitude_is_drawn(page, ground):
    opened(page, ground, "attitude")
    page.locator(".t-attitude__inset:not([hidden])").wait_for()
    legend = page.locator(".t-attitude__legend")
    sync_api.expect(legend).to_contain_text("deg/s")
    sync_api.expect(legend).to_contain_text("from the Earth's centre")
    picture = matplotlib.image.imread(io.BytesIO(page.locator(".t-attitude canvas").screenshot()))
    assert picture[..., :3].std() > 0.02  # body and Earth before a plain background
    # A satellite that has just been released does not know its attitude.
    sync_api.expect(page.locator(".t-attitude__banner")).to_have_text("attitude unknown")


def test_after_a_lost_connection_history_is_asked_for_again(page, ground):
    sockets, asked = [], []

    def routed(socket):
        sockets.append(socket)
        socket.connect_to_server()

    page.route_web_socket("**/api/live", routed)
    page.on("request", lambda request: asked.append(request.url))
    opened(page, ground)
    page.wait_for_function("window.torquer?.latency.length")
    asked.clear()
    with page.expect_request("**/history/extended/omega_x?*"):
        sockets[0].close()
    assert len(sockets) == 2
    page.evaluate("window.torquer.latency.length = 0")
    page.wait_for_function("window.torquer.latency.length")
