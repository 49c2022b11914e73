"""The command side in a browser: stack, plan, history, and what those see who only watch."""

import json
from pathlib import Path
from urllib.parse import quote

import pytest
from watched_page import CHROMIUM, browser_context, watched_page

from torquer.compile import engine

sync_api = pytest.importorskip("playwright.sync_api")
pytest.importorskip("uvicorn")
pytestmark = [
    pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium"),
]

PATIENCE_MS = 40_000
EXAMPLE = Path("examples/software/commissioning.toml")
VIEWS = ["commands", "history", "plan", "stack"]


@pytest.fixture(scope="module")
def ground(tmp_path_factory):
    from ground_flight import serving_slowly

    with serving_slowly(tmp_path_factory.mktemp("ground")) as client:
        yield client


@pytest.fixture(scope="module")
def context(ground):
    with browser_context(1280, 800, PATIENCE_MS) as context:
        yield context


@pytest.fixture
def page(context):
    with watched_page(context, "400 (Bad Request)") as page:
        yield page


def opened(page, ground, view, token=None):
    place = f"#/browse/torquer:chibis/torquer:chibis.view.{view}?hideInspector=true"
    page.goto(f"{ground.base}/?token={token or ground.token}&view={view}{place}")
    page.locator(".t-view").first.wait_for()
    return page


def focused(page, selector):
    """Go on with the key Tab until an element has the focus."""
    for _ in range(200):
        page.keyboard.press("Tab")
        if page.evaluate("selector => document.activeElement.matches(selector)", selector):
            return
    raise AssertionError(f"{selector} is not reached")


def test_a_stack_is_loaded_stepped_and_run_by_keys_alone(page, ground):
    opened(page, ground, "stack")
    page.locator(".t-stack").wait_for()
    focused(page, "[name=operator]")
    page.keyboard.type("Ада <i>")
    focused(page, ".t-stack [name=name]")
    page.keyboard.type("morning")
    focused(page, "textarea")
    page.keyboard.insert_text(EXAMPLE.read_text(encoding="utf-8"))
    focused(page, "button[name=load]")
    page.keyboard.press("Enter")
    head = page.locator(".t-stack__head")
    sync_api.expect(head).to_contain_text("morning: held (loaded); 0 of 5 steps")
    for place in (1, 2):
        focused(page, "button[name=next]")
        page.keyboard.press("Enter")
        page.locator(f"tr[data-place='{place}'][data-state=done]").wait_for()
    page.reload()
    sync_api.expect(head).to_contain_text("morning: held (loaded); 2 of 5 steps")
    assert page.locator("[name=operator]").input_value() == "Ада <i>"
    focused(page, "button[name=run]")
    page.keyboard.press("Space")
    sync_api.expect(head).to_contain_text("morning: over; 5 of 5 steps")
    (first, *_) = ground.get("chibis/sent")
    assert first["made_by"] == "Ада <i> (stated), page, stack 1 step 5"
    assert ground.get("chibis/stack")["stack"]["state"] == "over"


def test_a_wrong_stack_is_told_line_by_line(page, ground):
    opened(page, ground, "stack")
    page.locator("textarea").fill('[[commands]]\ncommand = "x"\n[[commands]]\ncommand = "reboot"\n')
    page.locator("button[name=load]").click()
    failure = page.locator(".t-stack .t-failure")
    sync_api.expect(failure).to_contain_text("commands[0].command: must be one of")
    sync_api.expect(failure).to_contain_text("commands[1].values.kind: must be given")


def test_a_stack_is_saved_shown_and_loaded_from_the_ground(page, ground):
    opened(page, ground, "stack")
    page.locator("input[type=file]").set_input_files(EXAMPLE)
    name = page.locator(".t-stack [name=name]")
    sync_api.expect(name).to_have_value("commissioning")
    page.locator("button[name=save]").click()
    line = page.locator(".t-stack__saved li", has_text="commissioning")
    line.wait_for()
    page.locator("textarea").fill("")
    line.get_by_role("button", name="Show").click()
    sync_api.expect(page.locator("textarea")).to_have_value(EXAMPLE.read_text(encoding="utf-8"))
    line.get_by_role("button", name="Load").click()
    sync_api.expect(page.locator(".t-stack__head")).to_contain_text("commissioning: held (loaded)")
    page.locator("button[name=abort]").click()
    sync_api.expect(page.locator(".t-stack__head")).to_contain_text("commissioning: aborted")
    page.on("dialog", lambda dialog: dialog.accept())
    line.get_by_role("button", name="Delete").click()
    sync_api.expect(line).to_have_count(0)


def test_the_plan_is_asked_for_and_a_command_is_taken_out(page, ground):
    body = {"command": "report_status", "values": {"module_id": 2}, "delay_s": 4000}
    headers = {"torquer-operator": quote("Ben <b>")}
    _, answer, _ = ground.raw("/api/chibis/commands", json.dumps(body).encode(), **headers)
    number = str(json.loads(answer)["id"])
    opened(page, ground, "plan")
    page.locator("button[name=ask]").click()
    line = page.locator("tr[data-mark='as sent']").filter(has_text="Ben <b> (stated)")
    sync_api.expect(line).to_contain_text(number)
    sync_api.expect(page.locator(".t-plan__age")).to_contain_text("s old.")
    line.get_by_role("button", name="Cancel").click()
    sync_api.expect(page.locator("tr[data-mark='over since']")).to_contain_text("cancelled")
    page.locator("button[name=ask]").click()
    sync_api.expect(page.locator("tr[data-mark='over since']")).to_have_count(0)


def test_the_history_is_filtered_and_saved(page, ground):
    ground.order("set_mode", region="stabilisation", state="science")
    opened(page, ground, "history")
    page.locator(".t-history [name=state]").select_option("refused")
    sync_api.expect(page.locator(".t-history [role=status]")).to_contain_text("1 command, newest")
    page.locator("tr[data-command=set_mode][data-state=refused]").wait_for()
    with page.expect_download() as download:
        page.get_by_role("button", name="CSV").click()
    head, *rows = Path(download.value.path()).read_text(encoding="utf-8").splitlines()
    assert head.startswith("id,request,command") and len(rows) == 1 and "set_mode" in rows[0]
    page.locator(".t-history [name=command]").fill("report")
    sync_api.expect(page.locator(".t-history [role=status]")).to_contain_text("no commands")


def test_older_commands_are_offered_once_it_is_known_that_there_are_some(page, ground):
    """Before the first answer there is no command that others are older than."""
    page.route("**/command-history?*", lambda route: None)  # which is never answered
    opened(page, ground, "history")
    page.locator(".t-history").wait_for()
    assert page.get_by_role("button", name="CSV").is_visible()
    assert not page.get_by_role("button", name="Older ones").is_visible()


@pytest.mark.parametrize("view", VIEWS)
def test_who_watches_has_no_button_that_would_fail(page, ground, view):
    ground.raw(
        "/api/chibis/commands",
        b'{"command": "report_status", "values": {"module_id": 2}, "delay_s": 5000}',
    )
    refused = []
    page.on("response", lambda answer: answer.status == 403 and refused.append(answer.url))
    opened(page, ground, view, ground.watcher)
    if view == "commands":
        page.locator("button[data-command=report_status]").click()
        page.locator("tr[data-state=received]").first.wait_for()
    if view == "plan":
        page.locator("tr[data-mark]").first.wait_for()
    if view != "history":
        sync_api.expect(page.locator(".t-watches")).to_contain_text("may only watch")
    for button in page.locator(".t-view button:enabled:visible:not(.t-command)").all():
        button.click()
    assert refused == []
    disabled = page.locator(".t-view button:disabled")
    assert (disabled.count() > 0) == (view != "history")
    assert page.locator(".t-view [name=operator]").count() == 0
