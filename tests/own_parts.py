"""Parts of the user's own, as files, for tests of all that takes a part of its kind."""

import shutil
from pathlib import Path

import pytest

from torquer.base.user_code import admit
from torquer.compile import engine
from torquer.environment.earth.atmosphere import ATMOSPHERES
from torquer.environment.field import FIELDS
from torquer.scenario.load import scenario_from_text
from torquer.simulation.setup.simulate import RunStopped, simulate

whole_runs = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
compiled_only = pytest.mark.skipif(not engine.COMPILED, reason="about what does not compile")

ROOT = Path(__file__).parents[1]
TEXT = '''
import numpy as np


def ring(t_s, start, radius_km=6928.137, tilt_deg=97.6):
    """A circular orbit."""
    a = 1e3 * radius_km
    n = np.sqrt(3.986004418e14 / a**3)
    u, i = n * t_s, np.radians(tilt_deg)
    across = np.array([0.0, np.cos(i), np.sin(i)])
    node = np.array([1.0, 0.0, 0.0])
    r = np.cos(u)[:, None] * node + np.sin(u)[:, None] * across
    v = np.cos(u)[:, None] * across - np.sin(u)[:, None] * node
    return a * r, a * n * v


def dipole(r_ecef_m, years, scale=1.0):
    """A dipole along the Earth's axis."""
    distance = np.linalg.norm(r_ecef_m, axis=1)[:, None]
    up = r_ecef_m / distance
    moment = np.array([0.0, 0.0, -7.8e15]) * scale
    return (3.0 * up * (up @ moment)[:, None] - moment) / distance**3


def air(r_ecef_m, years, density=5e-13):
    """The same density everywhere."""
    return np.full(len(r_ecef_m), density)


def leak(here, size=1e-6, damping=0.0, growth=0.0):
    """A jet along x, a torque against the rate, and one that grows about z."""
    x, y, z = here.omega_body_rad_s
    return (size - damping * x, -damping * y, growth * here.t_s - damping * z)


def crosswise(here, gain=2.0):
    """The field in microtesla in other axes, and the light."""
    b, noise = here.b_body_t, here.noise
    return (gain * 1e6 * b[1] + noise[0], 1e6 * b[0], here.sunlit_fraction)


def all_of_it(here, share=1e-9):
    """What depends on all that there is."""
    b, up, light, flow = here.b_body_t, here.up_body, here.light_body_pa, here.flow_body
    return (
        share * (up[0] + 1e5 * light[1]),
        share * (flow[1] + 1e4 * b[0]),
        share * here.argument_of_latitude_rad,
    )
'''


def write(folder: Path, text: str = TEXT) -> Path:
    """A file of parts in a folder."""
    file = folder / "own.py"
    file.write_text(text)
    return file


def field_of(kind: str, folder: Path):
    """A field model of a kind, with its defaults; the user's own is a dipole."""
    if kind != "user":
        return FIELDS[kind]()
    made = FIELDS[kind](kind="user", file=write(folder), function="dipole")
    admit(made)
    return made


def atmosphere_of(folder: Path, **keys):
    """An atmosphere of the user's own."""
    made = ATMOSPHERES["user"](kind="user", file=write(folder), function="air", **keys)
    admit(made)
    return made


START = """
start = 2025-07-01T00:00:00Z
spacecraft.body.inertia_kg_m2 = [0.03, 0.03, 0.01]
spacecraft.coils.limit_a_m2 = 0.2
initial.rate_deg_s = [1, -2, 0.5]
simulation = { duration_s = 900, record_s = 5.0 }
"""
OFF = 'control = { law = { kind = "off" }, sample_s = 1.0 }\n'
RING = (
    'orbit = { kind = "user", file = "own.py", function = "ring", axes = "J", revolution_s = 5740 }'
)
CIRCULAR = 'orbit = { kind = "circular", radius_km = 6928.137, inclination_deg = 97.6 }'
FIELD = 'environment.field = { kind = "user", file = "own.py", function = "dipole" }'
AIR = 'environment.atmosphere = { kind = "user", file = "own.py", function = "air" }'
DRAG = "spacecraft.aerodynamics.parts = [{ kind = 'box', size_m = [0.1, 0.1, 0.3], "
DRAG += "centre_m = [0.0, 0.01, 0.02] }]"
LEAK = 'disturbance.own.leak = { kind = "user", file = "own.py", function = "leak" }'
WHOLE = 'disturbance.own.all = { kind = "user", file = "own.py", function = "all_of_it" }'
ESTIMATED = 'control = { law = { kind = "bdot_rate", gain_a_m2_s_per_t = 2e4 }, sample_s = 1.0, '
ESTIMATED += 'estimator = { kind = "user", file = "estimate.py" } }\n'
MINE = 'control = { law = { kind = "user", file = "law.py" }, sample_s = 1.0 }\n'
LAW = '''
import torquer


@torquer.law(parameters={"gain": 1e-3}, memory={"read": (0.0, 0.0, 0.0)})
def mine(inputs, parameters, memory):
    """A dipole by what the sensor reads."""
    x, y, z = inputs.own_reading
    memory.read[0], memory.read[1], memory.read[2] = x, y, z
    return (parameters.gain * x, 2.0 * parameters.gain * y, 0.05 * z)
'''
SENSOR = "spacecraft.own_sensor = { kind = 'user', file = 'own.py', function = 'crosswise', "
SENSOR += "noise = 0.05 }"
EVERY = {
    "spacecraft.own_sensor": [SENSOR],
    "orbit": [RING],
    "environment.field": [FIELD],
    "environment.atmosphere": [AIR, DRAG],
    "disturbance.own.leak": [LEAK],
    "control.estimator": [],
}
#: Control of those that are none of `EVERY`, or need one of their own.
CONTROLS = {"control.estimator": ESTIMATED, "control.law": MINE}


def scenario_maker(tmp_path: Path):
    """A function that makes the scenario of some lines, beside a file of parts."""
    write(tmp_path)
    shutil.copy(ROOT / "examples/own_parts.py", tmp_path / "estimate.py")
    (tmp_path / "law.py").write_text(LAW)

    def make(*lines, control=OFF):
        text = own_text(*lines, control=control)
        (tmp_path / "scenario.toml").write_text(text)
        return scenario_from_text(text, folder=tmp_path)

    return make


def own_text(*lines, control=OFF) -> str:
    """The text of a scenario of some lines."""
    lines = lines if any("orbit = " in line for line in lines) else (CIRCULAR, *lines)
    return "\n".join((START, *lines)) + "\n" + control


def of_key(scenario, key):
    """The scenario with the part of a key."""
    return scenario(*EVERY.get(key, ()), control=CONTROLS.get(key, OFF))


def all_parts(scenario):
    """The scenario with every part."""
    return scenario(RING, FIELD, AIR, DRAG, LEAK, WHOLE, SENSOR, control=ESTIMATED)


#: Line of each part, what else it needs, its function and the function's arguments.
PARTS = {
    "orbit": (RING, (), "ring", "t_s, start", "radius_km=6928.137"),
    "environment.field": (FIELD, (), "dipole", "r_ecef_m, years", "scale=1.0"),
    "environment.atmosphere": (AIR, (DRAG,), "air", "r_ecef_m, years", "density=5e-13"),
    "disturbance.own.leak": (LEAK, (), "leak", "here", "size=1e-6"),
    "spacecraft.own_sensor": (SENSOR, (), "crosswise", "here", "gain=2.0"),
}
#: Where the bodies of the two compiled functions begin, and the estimator's and the law's.
BEGINS = {
    "disturbance.own.leak": "    x, y, z = here.omega_body_rad_s\n",
    "spacecraft.own_sensor": "    b, noise = here.b_body_t, here.noise\n",
    "control.estimator": "    share, read, omega = parameters.share",
    "control.law": "    x, y, z = inputs.own_reading\n",
}
ESTIMATE = (ROOT / "examples/own_parts.py").read_text()
FILES = {"control.estimator": ("estimate.py", ESTIMATE), "control.law": ("law.py", LAW)}
NAMES = {"control.estimator": "calm", "control.law": "mine"} | {
    key: part[2] for key, part in PARTS.items()
}
#: Brief runs: twenty control steps.
BRIEF = {"duration_s": 20.0, "record_s": 2.0}


def made(scenario, key, more=""):
    """The brief scenario with the part of a key; `more` stands among the part's own keys."""

    def with_more(line):
        return line.replace("file =", f"{more}, file =", 1) if more else line

    of_laws = [SENSOR] if key == "control.law" else []
    if key in PARTS:
        line, others, *_ = PARTS[key]
        found = scenario(with_more(line), *others)
    else:
        found = scenario(*of_laws, control=with_more(CONTROLS[key]))
    return found.replace("simulation", BRIEF)


def put(folder, key, old, new, text=None):
    """The file of a part with another text in it."""
    name, usual = FILES.get(key, ("own.py", TEXT))
    text = usual if text is None else text
    assert old in text
    (folder / name).write_text(text.replace(old, new))
    return folder / name


def message(call, *given):
    """The one line with which a call rejects what it is given."""
    with pytest.raises(ValueError) as error:
        call(*given)
    assert "\n" not in str(error.value)
    return str(error.value)


def stopped(made, to=None):
    """How a run stops: its message, and what was computed until then."""
    with pytest.raises(RunStopped) as error:
        simulate(made, to=to)
    assert "\n" not in str(error.value)
    assert error.value.result.attrs["how_it_ended"] == "failed"
    return str(error.value), error.value.result
