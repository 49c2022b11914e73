"""The law file beside its plots: read, saved, simulated again; no other file, no lost edit."""

import pytest
from watched_page import CHROMIUM, browser_context, serious_findings, watched_page

from torquer.compile import engine
from torquer.pages.board.text import data_from_toml
from torquer.scenario.toml_text import toml_from_data

LAW = """import torquer


@torquer.law(parameters={"gain": 1.0})
def brake(inputs, parameters, memory):
    x, y, z = inputs.b_body_t
    return (parameters.gain * x, parameters.gain * y, parameters.gain * z)
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "brake.py").write_text(LAW, encoding="utf-8")
    (tmp_path / "other.py").write_text("secret = 1\n", encoding="utf-8")
    return tmp_path


@pytest.fixture
def client(text, folder, serving):
    data = data_from_toml(text)
    data["control"]["law"] = {"kind": "user", "file": "brake.py"}
    own = toml_from_data(data)
    with serving(own, folder) as client:
        yield client


def test_the_law_of_the_scenario_is_read_and_replaced(client, folder):
    (file,) = client.post("/api/code", {})[1]["files"]
    assert (file["name"], file["text"]) == ("brake.py", LAW)
    text = LAW.replace("1.0", "2.0")
    status, found = client.post("/api/edit", {**file, "text": text})
    assert (status, found["text"]) == (200, text)
    assert (folder / "brake.py").read_text(encoding="utf-8") == text
    assert client.post("/api/edit", {"name": "brake.py", **found})[0] == 200
    assert sorted(each.name for each in folder.glob("*.p*")) == ["brake.py", "other.py"]


def test_line_ends_and_mode_of_a_file_are_kept(client, folder):
    path = folder / "brake.py"
    path.write_bytes(LAW.replace("\n", "\r\n").encode())
    path.chmod(0o750)
    (file,) = client.post("/api/code", {})[1]["files"]
    assert client.post("/api/edit", {**file, "text": LAW + "# more\n"})[0] == 200
    assert path.read_bytes() == (LAW + "# more\n").replace("\n", "\r\n").encode()
    assert path.stat().st_mode & 0o777 == 0o750


def test_what_was_edited_elsewhere_is_not_replaced(client, folder):
    (file,) = client.post("/api/code", {})[1]["files"]
    (folder / "brake.py").write_text(LAW + "# mine\n", encoding="utf-8")
    status, found = client.post("/api/edit", file)
    assert status == 422 and "was edited elsewhere" in found["errors"][0]["text"]
    assert (folder / "brake.py").read_text(encoding="utf-8").endswith("# mine\n")


@pytest.mark.parametrize(
    "name", ["other.py", "../brake.py", "/etc/passwd", "", "new.py", "./brake.py"]
)
def test_no_other_file_is_written(client, folder, name):
    before = {each: each.read_bytes() for each in folder.iterdir() if each.is_file()}
    (file,) = client.post("/api/code", {})[1]["files"]
    status, found = client.post("/api/edit", {**file, "name": name, "text": "x = 1\n"})
    assert (
        status == 422 and "must be a file of the scenario (brake.py)" in found["errors"][0]["text"]
    )
    assert {each: each.read_bytes() for each in folder.iterdir() if each.is_file()} == before


def test_whoever_only_watches_changes_nothing(client):
    status, answer, _ = client.raw("/api/edit", {}, token=client.server.watcher)
    assert status == 403 and b"must be command to change anything" in answer


def test_file_that_cannot_be_read_is_said_in_a_line(client, folder):
    (folder / "brake.py").write_bytes(b"\xff\xfe")
    status, found = client.post("/api/code", {})
    (error,) = found["errors"]
    assert (status, error["text"]) == (
        422, "brake.py: must be a file that can be read; received not UTF-8 text",
    )  # fmt: skip


def test_files_of_data_are_not_offered(text, tmp_path, serving):
    with serving(text, tmp_path) as client:
        assert client.post("/api/code", {}) == (200, {"files": []})


@pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_a_law_is_edited_beside_its_plots(client, folder):
    sync_api = pytest.importorskip("playwright.sync_api")
    with browser_context(1300, 800, 60_000.0) as context, watched_page(context, "422") as page:
        page.goto(f"{client.base}/?token={client.server.token}")
        sync_api.expect(page.locator("#theory")).to_be_visible()
        page.get_by_role("button", name="Python file").click()
        area = page.get_by_role("textbox", name="text of the Python file")
        sync_api.expect(area).to_be_focused()
        sync_api.expect(page.locator("#form")).to_be_hidden()
        assert serious_findings(page) == []
        area.fill(LAW.replace("parameters.gain * z)", "parameters.gain * z"))
        sync_api.expect(page.locator("#code [role=status]")).to_have_text("brake.py: not saved")
        page.keyboard.press("Control+s")
        failure = page.locator("#code .failure")
        sync_api.expect(failure).to_contain_text("control.law.file: must import; received Syntax")
        sync_api.expect(failure).to_contain_text("line 7")
        assert "\n" not in failure.inner_text()
        drawn = page.evaluate("board.drawn")
        area.fill(LAW)
        page.get_by_role("button", name="save and simulate").click()
        sync_api.expect(failure).to_be_empty()
        sync_api.expect(page.locator("#code [role=status]")).to_have_text("brake.py: saved")
        sync_api.expect(page.locator("#plots:not(.is-stale)")).to_have_count(1)
        assert page.evaluate("board.drawn") > drawn
    assert (folder / "brake.py").read_text(encoding="utf-8") == LAW
