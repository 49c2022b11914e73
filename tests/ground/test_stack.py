"""Command stacks: read and checked as a whole, stepped, run, held, kept over a restart."""

from contextlib import closing

import pytest
from archived import WrittenAtOnce, commands_on

from torquer.base.explain import ScenarioError
from torquer.computer.names import Names
from torquer.flight.packets.dictionary import load_dictionary
from torquer.flight.packets.frames import Stream
from torquer.flight.packets.reasons import Reason
from torquer.ground import stack as stack_module
from torquer.ground.archive import EPOCH_MS
from torquer.ground.commands import ANSWER_MS
from torquer.ground.stack import Stack
from torquer.ground.stack_file import (
    MOST_SAVED,
    MOST_STEPS,
    SavedStacks,
    check_stack,
    read_stack,
)

CHIBIS = load_dictionary("chibis_m")
SILENT = CHIBIS.model_copy(
    update={"down": {k: v for k, v in CHIBIS.down.items() if k != "acknowledgement"}}
)
NAMES = Names({"modes": (0, {"idle": 0, "science": 1})}, ("low",), {"bdot.gain": (0, 1)}, {}, ())
NOW = 1_800_000_000_000
#: The satellite's clock, a hundred seconds after the beginning of on-board time.
CLOCK = EPOCH_MS + 100_000
STATUS = '[[commands]]\ncommand = "report_status"\nvalues = {{ module_id = {} }}\n{}\n'


def steps(*keys):
    """A stack of as many commands, each with further keys."""
    return "".join(STATUS.format(n, each) for n, each in enumerate(keys, 1))


def checked(text, dictionary=CHIBIS, clock_ms=CLOCK):
    return check_stack(read_stack(text), dictionary, NAMES, clock_ms)


class Bench:
    """A stack on an archive, with a satellite's answers; `now`: time of the ground."""

    def __init__(self, path):
        self.spool = WrittenAtOnce(path, CHIBIS)
        self.archive = self.spool.archive
        self.commands = commands_on(self.archive, CHIBIS, NAMES)
        self.uplink, self.frames, self.notes, self.changes = Stream(CHIBIS, "up"), [], [], []
        self.now, self.is_linked = NOW, True
        self.stack = Stack(self, self.changes.append)

    def order(self, sent, by):
        return [self.commands.order(each, by, self.now, CLOCK) for each in sent]

    def cancel(self, number, by):
        return self.commands.cancel(number, by, self.now)

    def note(self, severity, text):
        self.notes.append(text)

    def load(self, text, name="morning"):
        return self.stack.load(checked(text), name, "Ada")

    def act(self, action, by="Ada"):
        state = self.stack.state()
        return self.stack.act(action, state["id"], state["next"], by)

    def turn(self, times=1):
        """Let the ground send what is due, and the stack go on."""
        for _ in range(times):
            self.stack.advance(self.now)
            for number, frame in self.commands.due(self.now) if self.is_linked else ():
                self.frames += self.uplink.feed(frame)
                self.commands.sent(number, self.now)

    def answer(self, code=Reason.DONE):
        """Answer the last command that went up."""
        frame = self.frames[-1]
        values = {
            "command_id": frame.packet.id, "module_id": frame.module, "accepted": int(not code),
            "code": int(code), "command_time": frame.time_s, "request": frame.request,
        }  # fmt: skip
        self.commands.answered(values, self.now)
        self.turn()

    @property
    def modules(self):
        """The modules that were asked, in order."""
        return [frame.values[-1] for frame in self.frames]

    @property
    def states(self):
        return [each["state"] for each in self.stack.state()["steps"]]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "sat.sqlite"


@pytest.fixture
def bench(path):
    made = Bench(path)
    with closing(made.archive):
        yield made


# Files


def test_what_a_step_waits_for_depends_on_the_command():
    keys = (
        "",
        "delay_s = 60",
        "acknowledge = false",
        'wait_for = "none"',
        "at = 2012-01-01T00:00:00Z",
    )
    found = checked(steps(*keys) + '[[commands]]\ncomment = "the end"').commands
    usual = ["executed", "received", "none", "none", "received", "none"]
    assert [each.wait_for for each in found] == usual
    assert [each.wait_for for each in checked(steps("", "delay_s = 60"), SILENT).commands] == [
        "none"
    ] * 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "commands: "),
        ("commands = []", "commands: must have 1 or more values"),
        ("[[commands]]\npause_s = 1", "commands[0].command: must be given, or comment"),
        (steps('pause_s = -1'), "commands[0].pause_s: must be"),
        (steps('pause_s = 1e9'), "commands[0].pause_s: must be"),
        (steps('wait_for = "never"'), "commands[0].wait_for: must be"),
        (steps('wait_for = "executed"\nacknowledge = false'), "commands[0].wait_for: must be none"),
        (steps("", "at = 2009-01-01T00:00:00Z"), "commands[1].at: must lie within the years 2010"),
        (steps("", "at = 2010-01-01T00:00:30Z"), "commands[1].at: must be after the sat"),
        (steps("", "at = 2012-01-01T00:00:00"), "commands[1].at: must be a time with a zone"),
        (steps("delay_s = 1\nat = 2012-01-01T00:00:00Z"), "at: must not be given with delay_s"),
        ('stop_on = "x"\n' + steps(""), "stop_on: must be"),
        ("[[commands", "stack: must be TOML"),
        (steps("") * (MOST_STEPS + 1), f"commands: must be at most {MOST_STEPS}"),
        (" " * 300_000, "stack: must be text of at most"),
        ('[[commands]]\ncomment = "\ud800"', "stack: must be text of at most"),
    ],
    ids=lambda value: None if len(value) < 60 else value[:20],
)  # fmt: skip
def test_a_wrong_file_gets_one_line(text, message):
    with pytest.raises(ScenarioError) as refused:
        checked(text)
    assert message in str(refused.value) and "\n" not in str(refused.value)


def test_all_that_is_wrong_is_told_before_the_first_goes_up(bench):
    text = steps("") + '[[commands]]\ncommand = "x"\n' + STATUS.format(999, "")
    with pytest.raises(ScenarioError) as refused:
        bench.load(text)
    lines = str(refused.value).split("\n")
    assert [line.split(":")[0] for line in lines] == [
        "commands[1].command",
        "commands[2].values.module_id",
    ]
    bench.turn(3)
    assert bench.stack.state() is None and bench.modules == []
    many = '[[commands]]\ncommand = "x"\n' * 100
    with pytest.raises(ScenarioError, match="80 more are wrong"):
        bench.load(many)


def test_stacks_are_saved_listed_and_deleted(tmp_path):
    saved = SavedStacks(tmp_path / "stacks")
    assert saved.names() == []
    with pytest.raises(ScenarioError, match=r"^name: must be that of a saved stack, and none is"):
        saved.text("morning")
    saved.save("morning", "a = 1\r\n# é\n")
    saved.save("evening", "b = 1\n")
    saved.save("morning", "c = 1\n")
    assert (saved.names(), saved.text("morning")) == (["evening", "morning"], "c = 1\n")
    saved.delete("morning")
    assert saved.names() == ["evening"]
    for ask in (saved.text, saved.delete):
        with pytest.raises(ScenarioError, match="name: must be one of evening; received morning"):
            ask("morning")
    for n in range(MOST_SAVED - 1):
        saved.save(f"n{n}", "")
    saved.save("evening", "again")
    with pytest.raises(ScenarioError, match="name: must be one of those that are saved"):
        saved.save("one_more", "")


@pytest.mark.parametrize(
    "name", ["../x", "", "A", "a/b", "a.b", ".", "x" * 61, "a b", None, 3, "a\0"]
)
def test_no_name_leads_out_of_the_folder(tmp_path, name):
    saved = SavedStacks(tmp_path / "stacks")
    (tmp_path / "x.toml").write_text("")
    for ask in (saved.text, saved.delete, lambda each: saved.save(each, "")):
        with pytest.raises(ScenarioError, match="name: must be words of lower-case"):
            ask(name)
    assert (tmp_path / "x.toml").exists()


# Running


def test_steps_go_up_one_by_one(bench):
    told = bench.load(steps("", "") + '[[commands]]\ncomment = "done"')
    assert (told["state"], told["next"], told["loaded_by"]) == ("held", 1, "Ada")
    bench.turn(3)
    assert bench.modules == [] and bench.states == ["ready"] * 3
    bench.act("next")
    bench.turn(3)
    assert bench.modules == [1] and bench.states == ["going", "ready", "ready"]
    bench.answer()
    bench.turn(3)
    assert bench.modules == [1] and bench.states == ["done", "ready", "ready"]
    bench.act("skip")
    bench.act("next")
    assert bench.states == ["done", "skipped", "done"]
    bench.turn()
    assert bench.stack.state()["state"] == "over" and bench.modules == [1]
    assert bench.notes[-1] == "stack morning: over"
    (made,) = bench.archive.read("SELECT made_by FROM _commands")
    assert made == ("Ada, stack 1 step 1",)


def test_a_run_waits_for_each_answer_and_pauses(bench, monkeypatch):
    clock = 1000.0
    monkeypatch.setattr(stack_module.time, "monotonic", lambda: clock)
    bench.load(steps("pause_s = 10", "", 'wait_for = "none"', ""))
    bench.act("run")
    bench.turn(5)
    assert bench.modules == [1]
    bench.answer()
    bench.turn(5)
    assert bench.modules == [1] and bench.stack.state()["pause_s"] == 10.0
    clock += 10.0
    bench.turn(5)
    assert bench.modules == [1, 2]
    bench.answer()
    bench.turn(5)
    assert bench.modules == [1, 2, 3, 4]
    bench.answer()
    assert bench.stack.state()["state"] == "over"


def test_a_delayed_command_counts_when_it_is_received_or_executed(bench):
    at = "at = 2010-01-01T00:10:00Z"
    bench.load(steps(at, f'{at}\nwait_for = "executed"', ""))
    bench.act("run")
    bench.turn(3)
    assert bench.frames[0].time_s == 600
    bench.answer(Reason.WAITING)
    bench.turn(3)
    assert bench.modules == [1, 2]
    bench.answer(Reason.WAITING)
    bench.turn(3)
    assert bench.modules == [1, 2] and bench.states == ["done", "going", "ready"]
    bench.answer()
    bench.turn(3)
    assert bench.modules == [1, 2, 3]


def test_at_s_counts_from_the_beginning_of_the_run(bench, monkeypatch):
    monkeypatch.setattr(stack_module, "now_ms", lambda: bench.now)
    bench.load(steps("", "at_s = 60"))
    bench.act("run")
    bench.turn(2)
    bench.answer()
    bench.now = NOW + 59_999
    bench.turn(3)
    assert bench.modules == [1]
    bench.now = NOW + 60_000
    bench.turn(3)
    assert bench.modules == [1, 2]


@pytest.mark.parametrize("code", [Reason.VALUE, Reason.CANCELLED, None])
@pytest.mark.parametrize("stop_on", ["never", "refused"])
def test_a_command_that_fails_holds_the_run_or_does_not(bench, code, stop_on):
    bench.load(f'stop_on = "{stop_on}"\n' + steps("", ""))
    bench.act("run")
    bench.turn()
    if code is None:
        bench.commands.expire(bench.now + ANSWER_MS + 1, None)
    else:
        bench.answer(code)
    bench.turn(3)
    found = bench.stack.state()
    assert found["steps"][0]["state"] == "failed"
    if stop_on == "never":
        assert bench.modules == [1, 2] and found["state"] == "running"
        return
    assert bench.modules == [1] and found["state"] == "held"
    assert found["reason"].startswith("step 1, command 1, is ")
    bench.act("run")
    bench.turn(2)
    bench.answer()
    found = bench.stack.state()
    assert bench.modules == [1, 2]
    assert (found["state"], found["reason"]) == ("over", "1 of 2 steps failed")


def test_a_refusal_holds_the_run_though_nobody_waited_for_it(bench):
    bench.load(steps('wait_for = "none"\npause_s = 9', ""))
    bench.act("run")
    bench.turn()
    bench.stack.state()  # whoever looks takes nothing away
    bench.commands.answered({
        "command_id": bench.frames[0].packet.id, "module_id": 1, "accepted": 0,
        "code": int(Reason.VALUE), "command_time": 0, "request": 1,
    }, bench.now)  # fmt: skip
    assert bench.stack.state()["steps"][0]["state"] == "failed"
    bench.turn(2)
    assert bench.stack.state()["state"] == "held" and bench.modules == [1]


def test_a_late_answer_makes_good_what_was_unanswered(bench):
    bench.load(steps("", ""))
    bench.act("run")
    bench.turn()
    bench.commands.expire(bench.now + ANSWER_MS + 1, None)
    bench.turn()
    assert bench.states == ["failed", "ready"]
    bench.answer()
    assert bench.states == ["done", "ready"] and bench.stack.state()["state"] == "held"


def test_a_held_run_sends_nothing_and_goes_on(bench):
    bench.load(steps("", "", ""))
    bench.act("run", "Ada")
    bench.turn()
    bench.act("hold", "Ben")
    bench.answer()
    bench.turn(5)
    assert bench.modules == [1] and bench.stack.state()["reason"] == "held by Ben"
    bench.act("run", "Ben")
    bench.turn(2)
    assert bench.modules == [1, 2]
    assert bench.archive.read("SELECT made_by FROM _commands")[1] == ("Ben, stack 1 step 2",)


def test_an_aborted_stack_cancels_what_waits_here(bench):
    bench.load(steps("", ""))
    bench.is_linked = False
    bench.act("run")
    bench.turn(3)
    bench.act("abort")
    bench.is_linked = True
    bench.turn(3)
    assert bench.modules == [] and bench.stack.state()["state"] == "aborted"
    assert bench.commands.shown(1)["state"] == "cancelled"
    bench.load(steps(""), "another")
    assert bench.stack.state()["id"] == 2


def test_a_command_that_cannot_be_taken_holds_the_run(bench, monkeypatch):
    bench.load(steps("", ""))
    bench.act("run")
    monkeypatch.setattr(
        bench, "order", lambda *_: (_ for _ in ()).throw(ScenarioError("command: full"))
    )
    bench.turn(3)
    found = bench.stack.state()
    assert (found["state"], found["reason"]) == ("held", "step 1 was not taken: command: full")
    assert bench.states == ["ready", "ready"]
    with pytest.raises(ScenarioError, match="command: full"):
        bench.act("next")


WRONG = {
    "another action": ("fire", 1, 1, "action: must be one of next"),
    "another stack": ("run", 2, 1, "stack: must be the one that is loaded, that is 1; received 2"),
    "a step that has gone": ("next", 1, 2, "place: must be that of the next step, 1; received 2"),
    "no step": ("skip", 1, None, "place: must be that of the next step, 1; received None"),
    "hold of a held one": ("hold", 1, None, "stack: must be running for hold; received held"),
}


@pytest.mark.parametrize("what", sorted(WRONG))
def test_what_is_not_possible_is_refused(bench, what):
    action, number, place, message = WRONG[what]
    bench.load(steps("", ""))
    with pytest.raises(ScenarioError) as refused:
        bench.stack.act(action, number, place, "Ada")
    assert str(refused.value).startswith(message)
    bench.turn(2)
    assert bench.modules == [] and bench.states == ["ready"] * 2


def test_one_stack_at_a_time(bench):
    with pytest.raises(ScenarioError, match="stack: must be loaded before run; received none"):
        bench.stack.act("run", 1, None, "Ada")
    bench.load(steps(""))
    with pytest.raises(ScenarioError, match="must be over or aborted before another is loaded"):
        bench.load(steps(""))
    bench.act("run")
    with pytest.raises(ScenarioError, match="must be held for next; received running"):
        bench.act("next")
    bench.turn()
    bench.answer()
    with pytest.raises(ScenarioError, match="must be loaded; received one that is over"):
        bench.act("abort")
    bench.load(steps(""))


# Archives that take nothing


def test_a_run_waits_for_a_slow_archive(bench):
    bench.load(steps("", ""))
    bench.act("run")
    bench.spool.is_behind = True
    bench.turn(3)
    assert bench.modules == [] and bench.stack.state()["state"] == "running"
    bench.spool.is_behind = False
    bench.turn(2)
    assert bench.modules == [1]


def test_a_run_holds_while_nothing_is_archived(bench):
    bench.load(steps("", "", "", ""))
    bench.act("run")
    bench.turn(2)
    bench.spool.is_behind = bench.spool.is_failing = True
    bench.answer()
    bench.turn(3)
    found = bench.stack.state()
    assert bench.modules == [1] and found["state"] == "held"
    assert "nothing is archived" in found["reason"] and found["reason"] in bench.notes[-1]
    bench.act("run")  # by somebody who knows
    bench.turn(2)
    bench.answer()
    bench.turn(2)
    assert bench.modules == [1, 2, 3]
    bench.spool.is_behind = bench.spool.is_failing = False
    bench.turn(2)
    bench.spool.is_behind = bench.spool.is_failing = True  # another time, which nobody knows
    bench.answer()
    bench.turn(2)
    assert bench.modules == [1, 2, 3] and bench.stack.state()["state"] == "held"
    bench.act("next")
    bench.turn(2)
    assert bench.modules == [1, 2, 3, 4]


# Restarts


def test_a_ground_that_starts_again_holds_and_sends_nothing_twice(path):
    first = Bench(path)
    first.load(steps("", "", ""))
    first.act("run")
    first.turn(2)
    first.answer()
    first.turn(2)
    assert first.modules == [1, 2]
    first.archive.close()
    second = Bench(path)
    with closing(second.archive):
        found = second.stack.state()
        assert (found["state"], found["reason"]) == ("held", "the ground has started again")
        assert second.states == ["done", "going", "ready"] and found["next"] == 3
        second.turn(5)
        assert second.modules == []
        second.frames = first.frames
        second.answer()
        assert second.states == ["done", "done", "ready"]
        second.act("run")
        second.turn(2)
        assert second.modules == [1, 2, 3]


@pytest.mark.parametrize("is_made", [False, True])
def test_an_end_between_command_and_note_is_found_out(path, monkeypatch, is_made):
    """The process ends after the step was noted, before or after its command was made."""
    first = Bench(path)
    first.load(steps("", ""))
    order = first.order

    def ends(sent, by):
        if is_made:
            order(sent, by)
        raise KeyboardInterrupt

    monkeypatch.setattr(first, "order", ends)
    with pytest.raises(KeyboardInterrupt):
        first.act("next")
    first.archive.close()
    second = Bench(path)
    with closing(second.archive):
        second.turn(3)
        assert second.modules == []
        # a command that was not sent is cancelled by the start, and the step says so
        assert second.states == [["ready", "ready"], ["failed", "ready"]][is_made]
