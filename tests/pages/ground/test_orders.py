"""Routes of the command side: what is wrong gets one line, and a stack outlives the ground."""

import json

import pytest
from ground_flight import serving, table, until

pytest.importorskip("uvicorn")

STACK = '[[commands]]\ncommand = "report_status"\nvalues = { module_id = 1 }\n'
WRONG = b'{"text": "[[commands]]\\ncommand = \\"x\\""}'


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A ground whose satellite is silent: what is ordered waits."""
    with serving(tmp_path_factory.mktemp("g"), sat=table("tcp:127.0.0.1:9", None, None)) as made:
        yield made


def asked(client, method, path, body=b"{}", **headers):
    """(status, answer) of a request."""
    import http.client

    connection = http.client.HTTPConnection("127.0.0.1", client.port, timeout=60)
    try:
        headers = {"authorization": f"Bearer {client.token}", **headers}
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        text = answer.read().decode()
        return answer.status, json.loads(text) if text[:1] in "[{" else text
    finally:
        connection.close()


def load(client, text=STACK, **keys):
    return asked(client, "POST", "/api/sat/stack", json.dumps({"text": text, **keys}).encode())


def act(client, action, place=None):
    stack = client.get("sat/stack")["stack"]
    body = json.dumps({"stack": stack["id"], "place": place or stack["next"]}).encode()
    return asked(client, "POST", f"/api/sat/stack/{action}", body)


@pytest.mark.parametrize(
    ("method", "path", "body", "message"),
    [
        ("POST", "stack", b"[]", "stack: must be a JSON object"),
        ("POST", "stack", b"\xff", "stack: must be a JSON object"),
        ("POST", "stack", b"{" * 5000, "stack: must be a JSON object"),
        ("POST", "stack", b" " * 1_600_000, "stack: must have at most 1572864 bytes"),
        ("POST", "stack", b"{}", "name: must be words of lower-case"),
        ("POST", "stack", b'{"name": "none"}', "name: must be that of a saved stack, and none"),
        ("POST", "stack", b'{"name": "../x"}', "name: must be words of lower-case"),
        ("POST", "stack", b'{"name": 3, "text": ""}', "name: must be words of lower-case"),
        ("POST", "stack", b'{"text": 3}', "text: must be a stack as TOML; received 3"),
        ("POST", "stack", b'{"text": "\\ud800"}', "stack: must be a JSON object"),
        ("POST", "stack", b'{"text": ""}', "commands: must be given"),
        ("POST", "stack", WRONG, "commands[0].command: must be one of"),
        ("POST", "stack/fire", b'{"stack": 1, "place": 1}', "action: must be one of next"),
        ("POST", "stack/run", b'{"stack": 77}', "stack: must be loaded before run; received none"),
        ("POST", "stack/run", b"{}", "stack: must be a whole number from 0"),
        ("POST", "stack/run", b'{"stack": true}', "stack: must be a whole number from 0"),
        ("POST", "stack/run", b'{"stack": 1e400}', "stack: must be a whole number from 0"),
        ("POST", "stack/next", b'{"stack": 1, "place": "1"}', "place: must be a whole number"),
        ("POST", "stack/next", b" " * 2000, "stack: must have at most 1000 bytes"),
        ("PUT", "stacks/A", b'{"text": ""}', "commands: must be given"),
        ("PUT", "stacks/x", WRONG, "commands[0].command: must be one of"),
        ("DELETE", "stacks/x", b"", "name: must be that of a saved stack, and none"),
        ("GET", "stacks/x", b"", "name: must be that of a saved stack, and none"),
        ("GET", "stacks/..%2fx", b"", "there is no such thing"),
        ("GET", "stacks/%00", b"", "name: must be words of lower-case"),
        ("GET", "command-history?format=xml", b"", "format: must be json or csv"),
        ("GET", "command-history?state=lost", b"", "state: must be"),
        ("GET", "command-history?size=0", b"", "size: must be"),
        ("GET", "command-history?size=1e3", b"", "size: must be a whole number"),
        ("GET", "command-history?size=--5", b"", "size: must be a whole number"),
        ("GET", "command-history?start=" + "9" * 400, b"", "start: must be a whole number"),
        ("GET", "command-history?by=" + "x" * 101, b"", "by: must"),
        ("GET", "command-history?who=x", b"", "who: must be a known key"),
    ],
)  # fmt: skip
def test_what_is_wrong_gets_one_line(client, method, path, body, message):
    status, answer = asked(client, method, f"/api/sat/{path}", body)
    error = answer["error"]
    assert status in (400, 404) and message in error
    assert "\n" not in error and len(error) < 1200
    assert client.get("sat/stack") == {"stack": None, "saved": []}


def test_all_reads_answer_of_a_satellite_without_commands(client):
    assert client.get("sat/command-history") == []
    assert client.get("sat/plan") == {"reported_ms": None, "is_complete": False, "entries": []}
    assert asked(client, "GET", "/api/nobody/plan")[0] == 404


def test_a_stack_is_kept_and_held_by_the_next_ground(tmp_path):
    satellites = {"sat": table("tcp:127.0.0.1:9", None, None)}
    with serving(tmp_path, **satellites) as client:
        status, stack = load(client, STACK * 3, name="morning")
        assert (status, stack["state"], stack["next"]) == (200, "held", 1)
        assert load(client)[0] == 400
        assert act(client, "run")[0] == 200
        until(lambda: client.get("sat/sent"))
        status, answer = act(client, "next", 2)
        assert status == 400 and "must be held for next" in answer["error"]
        body = json.dumps({"text": STACK}).encode()
        assert asked(client, "PUT", "/api/sat/stacks/kept", body) == (200, {"name": "kept"})
    with serving(tmp_path, **satellites) as client:
        found = client.get("sat/stack")
        assert found["saved"] == ["kept"]
        stack = found["stack"]
        assert (stack["name"], stack["state"]) == ("morning", "held")
        assert [each["state"] for each in stack["steps"]] == ["failed", "ready", "ready"]
        assert stack["steps"][0]["became"] == "cancelled"
        assert len(client.get("sat/sent")) == 1
        # who saw the stack as it was before cannot send a step twice
        status, answer = act(client, "next", 1)
        assert status == 400 and "place: must be that of the next step, 2" in answer["error"]
        assert act(client, "next")[0] == 200
        until(lambda: len(client.get("sat/sent")) == 2)
        assert act(client, "abort")[0] == 200
        sent = client.get("sat/sent")
        assert sent[0]["state"] == "cancelled" and sent[0]["made_by"].endswith("stack 1 step 2")
        status, stack = load(client, name="kept", text=STACK)
        assert (status, stack["id"]) == (200, 2)


def test_a_folder_that_takes_no_stack_gets_one_line(tmp_path):
    (tmp_path / "stacks").write_text("a file where the folder should be")
    with serving(tmp_path, sat=table("tcp:127.0.0.1:9", None, None)) as client:
        body = json.dumps({"text": STACK}).encode()
        status, answer = asked(client, "PUT", "/api/sat/stacks/kept", body)
        assert status == 400 and "name: must be a stack that can be written" in answer["error"]
        for method in ("GET", "DELETE"):
            status, answer = asked(client, method, "/api/sat/stacks/kept")
            assert status == 400 and answer["error"].startswith("name: must be")
