"""Short runs that the report is tried on, made once."""

import pytest

from torquer.simulation.simulate import simulate
from torquer.simulation.spec import Scenario

NASTY = "<script>alert('x')</script> & <b>\"bold\"</b> costs $5 and $6"


def scenario(name="base", **sections) -> Scenario:
    """A small scenario; a section given replaces the keys of the same name."""
    base = {
        "name": name,
        "description": NASTY,
        "start": "2020-03-01T00:00:00Z",
        "seed": 7,
        "orbit": {"kind": "circular", "altitude_km": 500, "inclination_deg": 51.6},
        "environment": {"earth_rotation": "sidereal"},
        "spacecraft": {
            "body": {"inertia_kg_m2": [1.0, 1.2, 1.5]},
            "coils": {"limit_a_m2": 3.0},
            "magnetometer": {"bias_nt": [100.0, -200.0, 300.0]},
        },
        "initial": {"rate_deg_s": [6.0, -4.0, 5.0]},
        "control": {
            "law": {"kind": "bdot", "gain_a_m2_s_per_t": 2e6},
            "sample_s": 2.0,
            "measure_s": 4.0,
            "actuate_s": 4.0,
        },
        "simulation": {"duration_s": 7200.0, "step_s": 0.5, "record_s": 2.0},
    }
    for key, value in sections.items():
        base[key] = base[key] | value if isinstance(value, dict) else value
    return Scenario.model_validate(base)


@pytest.fixture(scope="session")
def make():
    """The scenario maker, for tests that need a run of their own."""
    return scenario


@pytest.fixture(scope="session")
def detumble():
    """B-dot with a measurement window over more than a revolution: 3601 records."""
    return simulate(scenario("detumble"))


@pytest.fixture(scope="session")
def report(detumble, tmp_path_factory):
    """Paths of the report of `detumble`, and the parts done as they were told."""
    from torquer.report import write_report

    told = []
    paths = write_report(detumble, tmp_path_factory.mktemp("report") / "made", told.append)
    return paths, told
