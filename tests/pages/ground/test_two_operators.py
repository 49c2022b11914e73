"""Two browsers of the role `command` that press the same at the same time."""

import json
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import pytest
from archived import WrittenAtOnce
from ground_flight import until

pytest.importorskip("uvicorn")

from torquer.computer.names import Names
from torquer.flight.packets.software_file import load_link
from torquer.ground.alarm_desk import AlarmDesk
from torquer.ground.stack_file import SavedStacks

STEP = "[[commands]]\ncommand = 'get_parameter'\nvalues = {index = 0}\n"


def at_once(client, path, *bodies):
    """(status, answer) of requests that are sent together, as JSON."""

    def ask(body):
        status, answer, _ = client.raw(f"/api/sat/{path}", json.dumps(body).encode())
        return status, json.loads(answer)

    with ThreadPoolExecutor(len(bodies)) as pool:
        return list(pool.map(ask, bodies))


def load(client):
    ((status, stack),) = at_once(client, "stack", {"text": 3 * STEP, "name": "morning"})
    assert status == 200, stack
    return stack["id"]


def over(client):
    state = client.get("sat/stack")["stack"]
    return state if state["state"] == "over" else None


def test_what_is_not_loaded_is_not_run(client):
    answers = at_once(client, "stack/run", {"stack": 0}, {"stack": 7})
    line = "stack: must be loaded before run; received none"
    assert answers == 2 * [(400, {"error": line})]


def test_the_same_stack_is_run_once(client, satellite):
    number, obeyed = load(client), len(satellite.obeyed)
    answers = at_once(client, "stack/run", *[{"stack": number, "place": 1}] * 4)
    assert sorted(status for status, _ in answers) == [200, 400, 400, 400]
    refused = [answer["error"] for status, answer in answers if status == 400]
    assert all(text == "stack: must be held for run; received running" for text in refused)
    assert [step["state"] for step in until(lambda: over(client))["steps"]] == 3 * ["done"]
    assert len(satellite.obeyed) - obeyed == 3


def test_the_same_step_is_sent_once(client, satellite):
    number, obeyed = load(client), len(satellite.obeyed)
    for place in (1, 2, 3):
        answers = at_once(client, "stack/next", *[{"stack": number, "place": place}] * 3)
        assert sorted(status for status, _ in answers) == [200, 400, 400]
    until(lambda: over(client))
    assert len(satellite.obeyed) - obeyed == 3


def test_the_same_stack_is_loaded_once(client):
    answers = at_once(client, "stack", *[{"text": STEP, "name": name} for name in "abcd"])
    assert sorted(status for status, _ in answers) == [200, 400, 400, 400]
    ((number, name),) = [(each["id"], each["name"]) for status, each in answers if status == 200]
    assert client.get("sat/stack")["stack"]["name"] == name
    answers = at_once(client, "stack/abort", *[{"stack": number}] * 2)
    assert sorted(status for status, _ in answers) == [200, 400]


def test_the_same_command_is_one_of_each_operator(client, satellite):
    obeyed = len(satellite.obeyed)
    body = {"command": "get_parameter", "values": {"index": 0}}
    answers = at_once(client, "commands", body, body)
    numbers = {answer["id"] for _, answer in answers}
    assert len(numbers) == 2, "nobody's command is taken for that of another"
    assert [client.ends(number, "sat")["state"] for number in numbers] == 2 * ["executed"]
    assert len(satellite.obeyed) - obeyed == 2


def test_stacks_of_one_name_that_are_saved_at_once_are_whole(tmp_path):
    saved = SavedStacks(tmp_path)
    texts = [f"# {letter * 100_000}\n" for letter in "abcd"]
    with ThreadPoolExecutor(4) as pool:
        for _ in range(20):
            list(pool.map(lambda text: saved.save("one", text), texts))
            assert saved.text("one") in texts
    assert [path.name for path in tmp_path.iterdir()] == ["one.toml"]


def test_the_same_alarm_is_acknowledged_by_who_was_quicker(tmp_path):
    spool, notes = WrittenAtOnce(tmp_path / "sat.sqlite", load_link().dictionary), []
    with closing(spool.archive):
        names = Names({}, (), {}, {}, ())
        note = lambda severity, text: notes.append(text)  # noqa: E731
        desk = AlarmDesk(spool, load_link().dictionary, names, note, print)
        desk.tell("ground.archive", "alarm", "not archived", 0)
        (alarm,) = desk.listed()["alarms"]
        seen = {alarm["key"]: alarm["number"]}
        (first,) = desk.acknowledge(seen, "ann", "a", [alarm["key"]])
        (second,) = desk.acknowledge(seen, "bob", "b", [alarm["key"]])
        assert first == second and second["acknowledged_by"] == "ann" and second["comment"] == "a"
        assert [text for text in notes if "acknowledged" in text] == [
            "acknowledged by ann: ground.archive (a)"
        ]


def test_a_latched_alarm_is_cleared_by_who_has_seen_that_it_was_acknowledged(tmp_path):
    spool = WrittenAtOnce(tmp_path / "sat.sqlite", load_link().dictionary)
    with closing(spool.archive):
        names, ignored = Names({}, (), {}, {}, ()), lambda *_: None
        desk = AlarmDesk(spool, load_link().dictionary, names, ignored, ignored)
        desk.tell("ground.archive", "alarm", "not archived", 0)
        alarm, _ = desk.alarms.of("ground.archive")
        alarm.latched = True
        seen = {alarm.key: alarm.number}
        assert desk.acknowledge(seen, "ann", "", seen)[0]["state"] == "acknowledged"
        desk.tell("ground.archive", None, "", 0)
        assert desk.acknowledge(seen, "bob", "", seen)[0]["state"] == "latched", "as he has seen it"
        assert desk.acknowledge(seen, "bob", "")[0]["state"] == "settling"
