"""Alarms: raised after their samples, acknowledged, returned, latched, shelved, counted, logged."""

import pytest
from hypothesis import given, settings, strategies as st

from torquer.base.limits import RequestError
from torquer.ground.alarm import Now
from torquer.ground.alarms import SETTLE_S, Alarms
from torquer.ground.limits import ALARM, IN_ORDER, UNKNOWN, WARNING, Rule, Verdict

KEY = "house.volts"
SAMPLES = {  # limits of 0 to 10, alarms beyond -5 to 15
    "ok": (5.0, Verdict(IN_ORDER)),
    "high": (12.0, Verdict(WARNING, frozenset({"above"}), "above 10 V")),
    "higher": (13.0, Verdict(WARNING, frozenset({"above"}), "above 10 V")),
    "alarm": (20.0, Verdict(ALARM, frozenset({"above"}), "above 15 V")),
    "low": (-2.0, Verdict(WARNING, frozenset({"below"}), "below 0 V")),
    "none": (None, Verdict(UNKNOWN)),
}


class Desk:
    """Alarms that are handed one sample a second."""

    def __init__(self, samples=1, latched=False):
        self.alarms, self.rule, self.at_s = Alarms({KEY}), Rule(KEY, samples, latched), 0

    @property
    def now(self):
        return Now(1_000_000 + 1000 * self.at_s, float(self.at_s))

    def take(self, *names):
        """What happened at each sample."""
        found = []
        for name in names:
            self.at_s += 1
            value, verdict = SAMPLES[name]
            event = self.alarms.judge(self.rule, verdict, value, 10_000 + self.at_s, self.now)
            found += [event.what] if event else []
            found += [each.what for each in self.alarms.tick(self.now)]
        return found

    def wait(self, seconds):
        self.at_s += seconds
        return [each.what for each in self.alarms.tick(self.now)]

    def acknowledge(self, number=None, comment=""):
        number = self.alarm.number if number is None else number
        return self.alarms.acknowledge(KEY, number, "ann", comment, self.now)

    @property
    def alarm(self):
        return self.alarms.of(KEY)[0]


def test_an_alarm_lasts_until_it_is_over_and_acknowledged():
    desk = Desk()
    assert desk.take("ok", "high", "higher") == ["raised"]
    alarm = desk.alarm
    assert (alarm.state, alarm.severity, alarm.value, alarm.extreme) == ("active", WARNING, 13, 13)
    assert (alarm.since_ms, alarm.limit) == (10_002, "above 10 V")
    assert desk.take("ok") == ["returned"] and desk.alarm.state == "returned"
    assert desk.wait(10 * SETTLE_S) == [] and desk.alarm is alarm, "nobody has seen it yet"
    assert desk.acknowledge().state == "settling"
    assert desk.wait(1) == ["closed"] and desk.alarm is None


def test_one_that_is_acknowledged_ends_by_itself():
    desk = Desk()
    desk.take("high")
    assert desk.acknowledge(comment="seen").state == "acknowledged"
    assert desk.take("high", "ok") == ["returned"] and desk.alarm.state == "settling"
    assert desk.wait(SETTLE_S - 1) == [] and desk.wait(1) == ["closed"]
    assert desk.take("high") == ["raised"] and desk.alarm.acknowledged_ms is None


def test_a_value_that_chatters_makes_one_alarm_with_a_count():
    desk = Desk()
    assert desk.take("high") == ["raised"]
    desk.acknowledge()
    events = desk.take(*["ok", "high"] * 500)
    assert set(events) == {"returned"} and desk.alarm.state == "acknowledged"
    assert desk.alarm.count == 501
    (violation,) = desk.alarms.violations.values()
    assert (violation.count, violation.start_ms, violation.end_ms) == (501, 10_001, 11_001)


def test_a_violation_after_a_pause_is_another():
    desk = Desk()
    desk.take("high", "ok")
    desk.wait(SETTLE_S)
    desk.take("higher", "ok")
    assert [v.extreme for v in desk.alarms.violations.values()] == [12.0, 13.0]
    assert desk.alarm.count == 2


def test_worse_or_other_calls_again():
    desk = Desk()
    desk.take("high")
    seen = desk.alarm.number
    desk.acknowledge()
    assert desk.take("alarm") == ["again"]
    assert (desk.alarm.state, desk.alarm.severity) == ("active", ALARM)
    with pytest.raises(RequestError, match=f"number: must be {desk.alarm.number}, since"):
        desk.acknowledge(seen)
    desk.acknowledge()
    assert desk.take("high") == [] and desk.alarm.severity == ALARM
    assert desk.alarm.condition == WARNING
    assert desk.take("alarm") == [], "it was acknowledged as an alarm"
    assert desk.take("low") == ["again"] and desk.alarm.limit == "below 0 V"
    assert desk.alarm.extreme == -2.0


def test_samples_in_a_row_before_it_counts_either_way():
    desk = Desk(samples=3)
    assert desk.take("high", "higher", "ok", "high", "high", "none", "high", "high") == []
    assert desk.alarm is None
    assert desk.take("high") == ["raised"]
    assert (desk.alarm.since_ms, desk.alarm.extreme) == (10_007, 12.0)
    assert desk.take("ok", "ok", "high", "ok", "ok") == [] and desk.alarm.state == "active"
    assert desk.take("ok") == ["returned"]
    assert desk.take("alarm", "alarm") == [] and desk.alarm.state == "returned"


def test_worse_counts_after_its_samples_too():
    desk = Desk(samples=2)
    assert desk.take("high", "high") == ["raised"]
    assert desk.take("alarm", "high", "alarm") == [] and desk.alarm.severity == WARNING
    assert desk.take("alarm") == ["again"] and desk.alarm.extreme == 20.0


def test_unknown_is_neither_in_order_nor_beyond():
    desk = Desk()
    assert desk.take("none") == [] and desk.alarm is None
    desk.take("high")
    assert desk.take("none", "none") == []
    assert (desk.alarm.condition, desk.alarm.value, desk.alarm.state) == (UNKNOWN, None, "active")
    desk.acknowledge()
    assert desk.wait(10 * SETTLE_S) == [] and desk.alarm.state == "acknowledged"
    assert desk.take("high") == [] and desk.alarm.count == 1, "the same violation"
    assert desk.take("none", "ok") == ["returned"]


def test_latched_stays_until_it_is_cleared():
    desk = Desk(latched=True)
    desk.take("high")
    desk.acknowledge()
    desk.take("ok")
    assert desk.wait(10 * SETTLE_S) == [] and desk.alarm.state == "latched"
    assert desk.acknowledge().state == "settling"
    assert desk.wait(1) == ["closed"]


def test_shelved_calls_for_nobody_for_a_time():
    desk = Desk()
    desk.alarms.shelve(KEY, 100.0, "bob", "manoeuvre", desk.now)
    desk.take("high")
    assert desk.alarms.counts() == {"alarm": 0, "warning": 0, "shelved": 1, "all": 1}
    assert desk.wait(98) == [] and desk.wait(1) == ["unshelved"]
    assert desk.alarms.counts() == {"alarm": 0, "warning": 1, "shelved": 0, "all": 1}
    desk.alarms.shelve(KEY, 100.0, "bob", "again", desk.now)
    desk.alarms.unshelve(KEY)
    assert desk.alarms.counts()["shelved"] == 0
    with pytest.raises(RequestError, match="alarm: must be shelved"):
        desk.alarms.unshelve(KEY)
    with pytest.raises(RequestError, match="with limits; received 'x'"):
        desk.alarms.shelve("x", 1.0, "bob", "", desk.now)


def test_what_is_not_there_cannot_be_acknowledged():
    with pytest.raises(RequestError, match="alarm: must be one that is there"):
        Desk().acknowledge(7)


def test_conditions_of_the_ground_are_alarms_too():
    alarms, now = Alarms(set()), Now(0, 0.0)
    assert alarms.tell("ground.archive", None, "", 0, now) is None
    event = alarms.tell("ground.archive", ALARM, "is not written since 12:00", 0, now)
    assert event.what == "raised"
    assert alarms.tell("ground.archive", ALARM, "is not written since 12:01", 1, now) is None
    assert alarms.tell("ground.archive", None, "", 2, now).what == "returned"


def test_memory_is_for_points_that_have_something():
    alarms, rule = Alarms({KEY}), Rule(KEY)
    for k in range(1000):
        name = ("ok", "none")[k % 2]
        alarms.judge(rule, SAMPLES[name][1], SAMPLES[name][0], k, Now(k, float(k)))
    assert not alarms._tracks


STEPS = st.one_of(
    st.sampled_from(list(SAMPLES)),
    st.sampled_from(["acknowledge", "shelve", "unshelve", "pause"]),
)


@settings(max_examples=300, deadline=None)
@given(st.lists(STEPS, max_size=60), st.integers(1, 3), st.booleans())
def test_no_alarm_is_lost_and_none_is_there_for_nothing(steps, samples, latched):
    """A twin that counts by hand: beyond for `samples` in a row there is an alarm; it goes only
    acknowledged, a minute after it was in order for as long."""
    desk, run, last = Desk(samples, latched), 0, None
    for step in steps:
        before = desk.alarm
        if step in SAMPLES:
            events = desk.take(step)
            run = run + 1 if step not in ("ok", "none") else 0
            last = step
            assert run < samples or desk.alarm is not None
            if "raised" in events:
                assert before is None or before is not desk.alarm
                assert run >= samples and desk.alarm.acknowledged_ms is None
            if desk.alarm is None and before is not None:
                assert before.state == "settling" and not before.latched
            if before is None and desk.alarm is not None:
                assert events == ["raised"]
        elif step == "acknowledge" and desk.alarm is not None:
            desk.acknowledge()
            assert desk.alarm.acknowledged_ms is not None
        elif step == "shelve":
            desk.alarms.shelve(KEY, 30.0, "bob", "why", desk.now)
        elif step == "unshelve" and desk.alarms.of(KEY)[1]:
            desk.alarms.unshelve(KEY)
        elif step == "pause":
            desk.wait(SETTLE_S)
        alarm = desk.alarm
        if alarm is not None:
            assert alarm.count >= 1 and alarm.signs
            if last == "ok" and samples == 1:
                assert alarm.state in ("returned", "settling", "latched")
            calls = alarm.acknowledged_ms is None and desk.alarms.of(KEY)[1] is None
            counts = desk.alarms.counts()
            assert counts[alarm.severity] == calls and counts["all"] == 1
    for violation in desk.alarms.violations.values():
        assert violation.start_ms <= violation.end_ms
