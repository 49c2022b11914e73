"""The board's routes: flights, theory, starts, texts; who is refused; what is stopped."""

import http.client
import json
import threading
import time

import numpy as np
import pytest
from unpacking import unpacked_answer

import torquer
from torquer.compile import engine
from torquer.pages.board import routes
from torquer.scenario.load import scenario_from_text

flies = pytest.mark.skipif(not engine.COMPILED, reason="whole flights: minutes without JIT")


def test_the_page_begins_with_the_scenario_of_the_board(served, data):
    status, answer, headers = served.raw("/api/start")
    assert (status, json.loads(answer)) == (200, {"data": data, "name": "satellite"})
    assert "default-src 'self'" in headers["content-security-policy"]
    assert "unsafe-eval" not in headers["content-security-policy"]
    assert served.raw("/")[0] == served.raw("/vendor/three/three.min.js")[0] == 200
    assert served.raw("/vendor/uplot/uPlot.iife.min.js")[2]["content-encoding"] == "gzip"
    assert served.raw("/../server.py")[0] == served.raw("/nothing.js")[0] == 404


@pytest.mark.parametrize(
    ("headers", "reason"),
    [
        ({"token": "guess"}, "wrong token"),
        ({"Origin": "http://evil.example"}, "foreign origin"),
        ({"Host": "evil.example"}, "wrong host"),
    ],
)
def test_strangers_are_refused(served, data, headers, reason):
    status, answer, _ = served.raw("/api/fly", {"data": data}, **headers)
    assert status == 403
    assert answer.decode() == f"{reason}: open the address that `torquer board` printed\n"
    assert served.refused[-1] == f"{reason} (http, /api/fly)"


@flies
def test_a_flight_is_that_of_simulate(served, data, text):
    status, answer, _ = served.raw("/api/fly", {"data": data})
    header, arrays = unpacked_answer(answer)
    result = torquer.simulate(scenario_from_text(text))
    assert status == 200 and header["numbers"]["simulated_s"] == result["time"].values[-1]
    assert np.array_equal(arrays["dipole"], result["dipole_body"].values)


@pytest.mark.parametrize("path", ["fly", "theory", "starts"])
def test_mistakes_come_with_their_keys(served, data, path):
    data["spacecraft"]["body"]["inertia_kg_m2"] = [0.01, 0.01, 0.05]
    status, found = served.post(f"/api/{path}", {"data": data})
    (error,) = found["errors"]
    assert (status, error["key"]) == (422, "spacecraft.body.inertia_kg_m2")
    assert "triangle inequality" in error["text"]


@pytest.mark.parametrize("body", [[], {}, {"data": 5}, {"data": None}])
def test_what_is_no_scenario_is_refused_in_a_line(served, body):
    status, found = served.post("/api/fly", body)
    assert status == 422 and found["errors"][0]["text"].count("must be") == 1


def test_toml_is_read_and_written(served, data, text):
    assert served.post("/api/read", {"toml": text}) == (200, {"data": data})
    status, found = served.post("/api/write", {"data": data})
    assert status == 200
    assert served.post("/api/read", found) == (200, {"data": data})
    status, found = served.post("/api/read", {"toml": "orbit = ["})
    assert status == 422 and found["errors"][0]["text"].startswith("scenario: must be TOML")


def test_the_form_is_that_of_the_data(served, data):
    data["control"]["law"] = {"kind": "sdot"}
    _, found = served.post("/api/form", {"data": data})
    keys = {field["key"] for table in found["tables"] for field in table["fields"]}
    assert "control.law.gain_a_m2_s" in keys and "control.law.gain_a_m2_s_per_t" not in keys


def test_theory_stands_next_to_it(served, data):
    _, found = served.post("/api/theory", {"data": data})
    lines = {line["name"]: line for line in found["lines"]}
    assert lines["highest rate braked"]["value"] == pytest.approx(90.0)  # pi/(1 s + 1 s)
    assert 0.5 < lines["settling time"]["value"] < 5.0
    data["control"]["sample_s"] = 3.0
    _, found = served.post("/api/theory", {"data": data})
    (line,) = (line for line in found["lines"] if line["name"] == "highest rate braked")
    assert line["value"] == pytest.approx(30.0)


def test_theory_says_whether_it_holds(served, data):
    """True motions stand beside the averaged one; about the intermediate axis there is none."""
    data["control"]["law"] = {"kind": "nutation_damping_rate", "gain_a_m2_s_per_t": 1e3}
    data["initial"] = {"rate_deg_s": [1.0, 0.0, 6.0]}
    data["spacecraft"]["body"] = {"inertia_kg_m2": [0.02, 0.02, 0.03]}
    _, found = served.post("/api/theory", {"data": data})
    (line,) = (line for line in found["lines"] if line["name"] == "true motions over the formula")
    assert 0.5 < line["value"] < 1.25 and line["about"].startswith("flown 3 times: ")
    data["spacecraft"]["body"] = {"inertia_kg_m2": [0.02, 0.03, 0.025]}
    _, found = served.post("/api/theory", {"data": data})
    assert not any("settling" in line["name"] for line in found["lines"])
    assert any("axis of the intermediate moment" in note for note in found["notes"])


def leave_at_once(served, path, body):
    """Ask, and close the connection before the answer."""
    connection = http.client.HTTPConnection("127.0.0.1", served.server.port)
    headers = {"Authorization": f"Bearer {served.server.token}"}
    connection.request("POST", path, json.dumps(body), headers)
    time.sleep(0.2)
    connection.close()


def test_what_a_page_no_longer_waits_for_is_stopped(served, data, monkeypatch):
    begun, ended = threading.Event(), threading.Event()

    def slow(scenario, orbits, is_superseded):
        begun.set()
        while not is_superseded():
            time.sleep(0.01)
        ended.set()
        raise routes.Superseded

    monkeypatch.setattr(routes, "fly", slow)
    leave_at_once(served, "/api/fly", {"data": data})
    assert begun.wait(20.0) and ended.wait(20.0)


def test_what_waits_is_not_begun_once_it_is_superseded(served, data, monkeypatch):
    flown, begun, go = [], threading.Event(), threading.Event()

    def slow(scenario, orbits, is_superseded):
        flown.append(scenario.control.sample_s)
        begun.set()
        go.wait(20.0)
        raise ValueError("control.sample_s: must be another")

    monkeypatch.setattr(routes, "fly", slow)
    first = threading.Thread(target=served.post, args=("/api/fly", {"data": data}))
    first.start()
    assert begun.wait(20.0)
    other = json.loads(json.dumps(data))
    other["control"]["sample_s"] = 2.0
    leave_at_once(served, "/api/fly", {"data": other})
    time.sleep(0.3)
    go.set()
    first.join(20.0)
    other["control"]["sample_s"] = 0.5
    assert served.post("/api/fly", {"data": other})[0] == 422
    assert flown == [1.0, 0.5]


@pytest.mark.parametrize("path", ["fly", "theory", "starts"])
def test_the_end_during_work_is_soon_and_without_a_word(
    text, data, path, tmp_path, serving, monkeypatch, capfd
):
    begun, go = threading.Event(), threading.Event()

    def stoppable(scenario, given, is_superseded):
        begun.set()
        while not is_superseded():
            time.sleep(0.01)
        raise routes.Superseded

    def theory(scenario):
        begun.set()
        assert go.wait(20.0)
        return {}

    monkeypatch.setattr(routes, "fly", stoppable)
    monkeypatch.setattr(routes, "predict", theory)
    monkeypatch.setattr(routes.Starts, "fly", lambda self, *given: stoppable(*given))
    found = []
    with serving(text, tmp_path) as client:
        ask = threading.Thread(
            target=lambda: found.append(client.raw(f"/api/{path}", {"data": data}))
        )
        ask.start()
        assert begun.wait(20.0)
        begun_s = time.monotonic()
    took_s = time.monotonic() - begun_s
    go.set()
    ask.join(20.0)
    assert took_s < 1.5  # open requests would be cut off after two seconds
    assert found[0][0] in (200, 499)
    assert capfd.readouterr().err == ""
