# ruff: noqa: E501 (tables as text)
"""Mode tables with one fault each: name -> (table, kind, what the line must say).

Written as in a scenario's `[control.modes]`. `FACTS` is the satellite around them.
"""

import tomllib

from torquer.computer.modes.finding import Facts

FACTS = Facts(
    step_s=1.0,
    kinds={"damping": "bdot", "spin": "spin_up", "hold": "wheel_pd", "sun": "sdot"},
    drives={
        **dict.fromkeys(("damping", "spin", "sun"), frozenset({"coils"})),
        "hold": frozenset({"wheels"}),
    },
    gives={
        "estimator": frozenset({"attitude", "rate"}),
        "none": frozenset(),
        "field_rate": frozenset({"rate"}),
        "filter": frozenset({"attitude", "rate", "sigma"}),
    },
    sensors=frozenset({"magnetometer", "gyro", "sun_sensors", "attitude_sensor"}),
)


def _ways(*pairs: str) -> str:
    """A region of states a and b: the given transition out of a, and a sound one back."""
    back = '{ to = "a", when = { signal = "field_nt", below = 20000 }, for_s = 60 }'
    ways = ", ".join(f'{{ to = "b", {pair} }}' for pair in pairs)
    return f"[states.a]\ntransitions = [{ways}]\n[states.b]\ntransitions = [{back}]"


def _when(*conditions: str, more: str = "for_s = 60") -> str:
    listed = ", ".join(f"{{ {each} }}" for each in conditions)
    return f"when = [{listed}]" + (f", {more}" if more else "")


_IDLE = '[regions.y.states.c]\ntransitions = [{ to = "d", when = { signal = "sun_in_view", above = 0.5 }, for_s = 60 }]\n[regions.y.states.d]'
_TO_AND_FRO = """
[regions.y.states.c]
transitions = [{ to = "d", when = { signal = "sun_in_view", above = 0.5 }, for_s = 60 }]
%s
[regions.y.states.d]
transitions = [{ to = "c", when = { signal = "sun_in_view", below = 0.5 }, for_s = 60 }]
%s
"""
_MAIN = """
[regions.x.states.a]
transitions = [{ to = "b", when = { signal = "rate_deg_s", below = 0.5 }, for_s = 60 }]
%s
[regions.x.states.b]
transitions = [{ to = "a", when = { signal = "rate_deg_s", above = 0.7 }, for_s = 60 }]
%s
"""


def _beside(a: str, b: str, c: str, d: str) -> str:
    """Regions x (a, b) and y (c, d), sound by themselves, with more keys in each state."""
    return _MAIN % (a, b) + _TO_AND_FRO % (c, d)


def _ring(count: int) -> str:
    """Any of some states leads to any other, at once; the strictest first."""
    ways = ", ".join(
        f'{{ to = "s{k}", when = {{ signal = "rate_deg_s", above = {0.1 * k:.1f} }} }}'
        for k in reversed(range(count))
    )
    return f"initial = 's0'\ntransitions = [{ways}]\n" + "\n".join(
        f"[states.s{k}]" for k in range(count)
    )


RATE = 'signal = "rate_deg_s"'
TABLES = {
    "contradictory limits": (
        _ways(_when(f"{RATE}, above = 0.7", f"{RATE}, below = 0.5")),
        "never",
        "rate above 0.7 deg/s and rate below 0.5 deg/s cannot hold together",
    ),
    "contradictory limits at one value": (
        _ways(_when(f"{RATE}, above = 0.5", f"{RATE}, below = 0.5")),
        "never",
        "cannot hold together",
    ),
    "contradictory limits, left by time": (
        _ways(_when(f"{RATE}, above = 0.7", f"{RATE}, below = 0.5", more="at_most_s = 600")),
        "never",
        "cannot hold together",
    ),
    "contradictory states of another region": (
        _ways(
            _when(
                'signal = "in_state", state = "b", above = 0.5',
                'signal = "in_state", state = "b", below = 0.5',
            )
        ),
        "never",
        "in state b and not in state b cannot hold together",
    ),
    "a rate below zero": (
        _ways(_when(f"{RATE}, below = -1")),
        "never",
        "rate_deg_s is never below 0 deg/s",
    ),
    "a rate above less than zero": (
        _ways(_when(f"{RATE}, above = -1")),
        "always",
        "rate above -1 deg/s always holds",
    ),
    "the Sun more than in view": (
        _ways(_when('signal = "sun_in_view", above = 1.0')),
        "never",
        "Sun in view above 1 never holds: sun_in_view is 0 or 1",
    ),
    "more than the whole Sun": (
        _ways(_when('signal = "sunlit_fraction", above = 1.5')),
        "never",
        "sunlit_fraction is within 0 to 1",
    ),
    "an angle beyond 180 deg": (
        "axis = [0, 0, 1]\n" + _ways(_when('signal = "axis_to_sun_deg", above = 200'), "at_most_s = 9"),
        "never",
        "axis_to_sun_deg is within 0 to 180 deg",
    ),
    "a nutation beyond 90 deg": (
        "axis = [0, 0, 1]\ninertia_kg_m2 = [1, 1.1, 1.5]\n"
        + _ways(_when('signal = "nutation_deg", below = 100')),
        "always",
        "nutation_deg is within 0 to 90 deg",
    ),
    "a change greater than the range": (
        "axis = [0, 0, 1]\n"
        + _ways(_when('signal = "axis_to_sun_deg", above = 190, since_entry = true'), "at_most_s = 9"),
        "never",
        "the change of axis_to_sun_deg is within -180 to 180 deg",
    ),
    "a count below zero": (
        _ways(_when('signal = "entries", state = "a", below = 0')),
        "never",
        "entries is never below 0",
    ),
    "hysteresis that never lets go": (
        _ways(_when(f"{RATE}, above = 1, back_below = -0.1")),
        "always",
        "holds for ever once it has held, for rate_deg_s is never below 0 deg/s; correct back_below",
    ),
    "shadowed by a weaker one": (
        _ways(_when(f"{RATE}, above = 0.5"), _when(f"{RATE}, above = 0.7")),
        "never",
        "never taken: the one to b (rate above 0.5 deg/s, for 60 s) comes first",
    ),
    "shadowed by one that waits for less": (
        _ways(
            _when(f"{RATE}, above = 0.5", more="for_s = 10"),
            _when(f"{RATE}, above = 0.7", 'signal = "sun_in_view", above = 0.5', more="for_s = 30"),
        ),
        "never",
        "put the stricter one first",
    ),
    "shadowed by two together": (
        _ways(
            _when(f"{RATE}, above = 0.5", more=""),
            _when(f"{RATE}, below = 0.6", more=""),
            _when(f"{RATE}, above = 0.1", 'signal = "sun_in_view", above = 0.5'),
        ),
        "never",
        "whenever it could be, another transition out of a comes first",
    ),
    "too late for the state": (
        _ways("at_most_s = 50", _when(f"{RATE}, below = 0.5", more="at_least_s = 100")),
        "never",
        "it takes at least 100 s, and the one to b is taken after 50 s at the latest",
    ),
    "at_least_s above at_most_s": (
        _ways(_when(f"{RATE}, below = 0.5", more="at_least_s = 100, at_most_s = 50")),
        "never",
        "they take 100 s or more, and at_most_s = 50 s is up before",
    ),
    "for_s above at_most_s": (
        _ways(_when(f"{RATE}, below = 0.5", more="for_s = 900, at_most_s = 600")),
        "never",
        "conditions and at_least_s do not matter",
    ),
    "opposite factors": (
        _beside("laws = { sun = 1.0 }", "", "", "laws = { sun = -1.0 }"),
        "conflict",
        "x.a and y.d can be active together, and multiply sun by 1 and -1",
    ),
    "damping and spin-up": (
        _beside('laws = ["damping"]', "", "", 'laws = ["spin"]'),
        "conflict",
        "damping takes away the rotation that spin makes",
    ),
    "coils on and off": (
        _beside('coils = "on"', "", "", 'coils = "off"'),
        "conflict",
        "x.a and y.d can be active together, and set the coils on and off",
    ),
    "two estimators": (
        _beside('estimator = "filter"', "", "", 'estimator = "field_rate"'),
        "conflict",
        "set different estimators",
    ),
    "a law while the coils stay off": (
        _MAIN % ('laws = ["damping"]', "") + '[regions.y.states.c]\ncoils = "off"',
        "no effect",
        "x.a: damping never acts: y.c keeps the coils off",
    ),
    "a law until the coils go off for ever": (
        _MAIN % ('laws = ["damping"]', "")
        + '[regions.y.states.c]\ntransitions = [{ to = "d", at_most_s = 900 }]\n'
        '[regions.y.states.d]\ncoils = "off"\nfinal = true',
        "no effect",
        "x.a: damping acts for a while only: y.d keeps the coils off for ever",
    ),
    "a law that another region switches off": (
        _MAIN % ('laws = ["damping"]', "") + '[regions.y.states.c]\nlaws_off = ["damping"]',
        "no effect",
        "x.a: damping never acts: y.c keeps it off whenever this state is active",
    ),
    "a law with its own coils off": (
        _ways(_when(f"{RATE}, below = 0.5")) + '\nlaws = ["damping"]\ncoils = "off"',
        "no effect",
        "main.b: damping never acts: main.b keeps the coils off",
    ),
    "a factor of zero": (
        _ways(_when(f"{RATE}, below = 0.5")) + "\nlaws = { damping = 0.0 }",
        "no effect",
        "main.b: damping has the factor 0",
    ),
    "two regions that wait for each other": (
        """
        [regions.x.states.a]
        transitions = [{ to = "b", when = { signal = "in_state", state = "d", above = 0.5 } }]
        [regions.x.states.b]
        final = true
        [regions.y.states.c]
        transitions = [{ to = "d", when = { signal = "in_state", state = "b", above = 0.5 } }]
        [regions.y.states.d]
        final = true
        """,
        "deadlock",
        "x.a and y.c wait for each other",
    ),
    "two regions that come to wait for each other": (
        """
        [regions.x.states.start]
        transitions = [{ to = "a", when = { signal = "rate_deg_s", below = 0.5 }, for_s = 60 }]
        [regions.x.states.a]
        transitions = [{ to = "start", when = { signal = "in_state", state = "c", below = 0.5 }, for_s = 60 }]
        [regions.y.states.idle]
        transitions = [{ to = "c", when = { signal = "sun_in_view", above = 0.5 }, for_s = 60 }]
        [regions.y.states.c]
        transitions = [{ to = "idle", when = { signal = "in_state", state = "a", below = 0.5 }, for_s = 60 }]
        """,
        "deadlock",
        "x.a and y.c wait for each other: together they are never left",
    ),
    "three regions in a ring": (
        "\n".join(
            f"""
            [regions.{x}.states.{x}0]
            transitions = [{{ to = "{x}1", when = {{ signal = "in_state", state = "{y}1", above = 0.5 }} }}]
            [regions.{x}.states.{x}1]
            final = true
            """
            for x, y in ("pq", "qr", "rp")
        ),
        "deadlock",
        "p.p0 and q.q0 and r.r0 wait for each other",
    ),
    "waiting for a state that is over": (
        """
        [regions.x.states.a]
        transitions = [{ to = "b", when = { signal = "rate_deg_s", below = 0.5 } }]
        [regions.x.states.b]
        transitions = [{ to = "a", when = { signal = "in_state", state = "c", above = 0.5 }, for_s = 60 }]
        [regions.y.states.c]
        transitions = [{ to = "d", at_most_s = 60 }]
        [regions.y.states.d]
        final = true
        """,
        "deadlock",
        "x.b: can never be left once y is in d",
    ),
    "a parameter never set back": (
        _ways(_when(f"{RATE}, below = 0.5")).replace("[states.a]", '[states.a]\nlaws = ["damping"]')
        + '\nlaws = ["damping"]\nset = { "damping.gain" = 1e4 }',
        "leftover",
        "main.a: damping works with its own damping.gain until main.b has set it",
    ),
    "a parameter set by another region": (
        _beside('laws = ["damping"]', "", "", 'set = { "damping.gain" = 1e4 }'),
        "leftover",
        "x.a: damping works with its own damping.gain until y.d has set it",
    ),
    "the age of a sensor that is not there": (
        _ways(_when('signal = "reading_age_s", sensor = "search_coil", above = 30')),
        "always",
        "age of search coil reading above 30 s always holds: the computer has no readings of the search coil",
    ),
    "a fresh reading of a sensor that is not there": (
        _ways(_when('signal = "reading_age_s", sensor = "tachometers", below = 5')),
        "never",
        "the computer has no readings of the tachometers",
    ),
    "waiting for a rate without an estimator": (
        _ways(_when(f"{RATE}, below = 0.5")).replace("[states.a]", '[states.a]\nestimator = "none"'),
        "never",
        "main.a -> b: never taken: rate_deg_s is not known here, where no estimator gives it",
    ),
    "waiting for an attitude that is not estimated": (
        'attitude = { reference = "orbital" }\n'
        + _ways(_when('signal = "attitude_error_deg", below = 5')).replace(
            "[states.a]",
            '[states.a]\nestimator = "field_rate"',
        ),
        "never",
        "attitude_error_deg is not known here",
    ),
    "at_most_s below the control step": (
        "[states.a]\n"
        'transitions = [{ to = "b", at_most_s = 1e-9 }]\n[states.b]\n'
        'transitions = [{ to = "a", at_most_s = 1e-9 }]',
        "chatter",
        "main: a -> b -> a can switch at every control step",
    ),
    "thresholds without a gap": (
        f'[states.a]\ntransitions = [{{ to = "b", when = {{ {RATE}, below = 0.5 }} }}]\n'
        f'[states.b]\ntransitions = [{{ to = "a", when = {{ {RATE}, above = 0.5 }} }}]',
        "chatter",
        "main: a -> b -> a can switch at every control step",
    ),
    "eight states, any to any": (_ring(8), "chatter", "can switch at every control step"),
    "ten states, any to any": (_ring(10), "chatter", "can switch at every control step"),
    "two regions that drive each other": (
        "\n".join(
            f"""
            [regions.{x}.states.{one}]
            transitions = [{{ to = "{two}", when = {{ signal = "in_state", state = "{other}", above = 0.5 }} }}]
            [regions.{x}.states.{two}]
            transitions = [{{ to = "{one}", when = {{ signal = "in_state", state = "{other}", below = 0.5 }} }}]
            """
            for x, one, two, other in (("x", "a", "b", "c"), ("y", "c", "d", "b"))
        ),
        "chatter",
        "can switch at every control step",
    ),
    "a state that nothing leads to": (
        _ways(_when(f"{RATE}, below = 0.5")) + "\n[states.lost]\nfinal = true",
        "unreachable",
        "main.lost: no transition leads there from the initial state a",
    ),
    "a trap": (_MAIN.replace("%s", "") + _IDLE, "trap", "y.d: nothing leads out"),
    "waiting for the unknown": (
        "axis = [0, 0, 1]\n" + _ways(_when('signal = "axis_to_sun_deg", above = 160')),
        "waits for the unknown",
        "main.a: can be left only while axis_to_sun_deg is known",
    ),
}  # fmt: skip


def table_of(name: str) -> dict:
    """A table as data."""
    return tomllib.loads(TABLES[name][0])
