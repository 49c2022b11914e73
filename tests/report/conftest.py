"""Short runs that the report is tried on, made once."""

import pytest
from picture_faults import faults

from torquer.report.common import figure as figures
from torquer.scenario.spec import Scenario
from torquer.simulation.setup.simulate import simulate

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


@pytest.fixture(autouse=True)
def _readable(monkeypatch):
    """Of each picture that these tests make, all can be read and nothing is cut off."""
    encode = figures.encode_png

    def checked(figure):
        data = encode(figure)
        assert faults(figure) == []
        return data

    monkeypatch.setattr(figures, "encode_png", checked)


@pytest.fixture(scope="session")
def make():
    """The scenario maker, for tests that need a run of their own."""
    return scenario


@pytest.fixture(scope="session")
def detumble():
    """B-dot with a measurement window over more than a revolution: 3601 records."""
    return simulate(scenario("detumble"))


#: Four wheels in a pyramid, one of which dies; a law holds the orbital attitude from 40 deg off.
PYRAMID = {
    "layout": {"kind": "four_sided_pyramid", "alpha_deg": 54.7356, "beta_deg": 45.0},
    "momentum_limit_n_m_s": 0.4,
    "torque_limit_n_m": 0.05,
    "coulomb_friction_n_m": 2e-4,
    "minimum_speed_fraction": 0.1,
    "failures": [{"wheel": 2, "time_s": 900.0, "noticed_after_s": 30.0}],
}
HOLD = {
    "kind": "wheel_pd",
    "bandwidth_rad_s": 0.1,
    "inertia_kg_m2": [1.0, 1.2, 1.5],
    "euler_deg": [10.0, -20.0, 30.0],
}
WITH_WHEELS = {
    "spacecraft": {"wheels": PYRAMID, "coils": {"limit_a_m2": 3.0}},
    "initial": {
        "reference": "orbital",
        "euler_deg": [10.0, -20.0, 70.0],
        "rate_deg_s": [0.0, 0.0, 0.0],
        "rate_relative_to": "orbital",
    },
    "control": {
        "law": None,
        "laws": {"coils": {"kind": "unloading", "gain_per_s": 1e-3}, "wheels": HOLD},
        "sample_s": 1.0,
        "measure_s": 0.0,
        "actuate_s": None,
    },
    "simulation": {"duration_s": 1800.0, "step_s": 0.5, "record_s": 2.0},
}


@pytest.fixture(scope="session")
def flown():
    """Wheels unloaded by coils; wheel 2 dies at half time."""
    return simulate(scenario("flown", **WITH_WHEELS))


@pytest.fixture(scope="session")
def alone():
    """The same wheels on a satellite without coils."""
    return simulate(scenario("alone", **without_coils(WITH_WHEELS)))


def without_coils(sections: dict) -> dict:
    """Sections of a scenario without coils and their law."""
    spacecraft = {**sections["spacecraft"], "coils": None}
    control = sections["control"] | {"law": None, "laws": {"wheels": HOLD}}
    return {**sections, "spacecraft": spacecraft, "control": control}


#: B-dot until the rotation is slow, then a pitch wheel and the coils; day and night beside it.
SWITCHING = {
    "spacecraft": {"wheels": {k: v for k, v in PYRAMID.items() if k != "failures"}},
    "initial": {"rate_deg_s": [0.6, -0.4, 0.5]},
    "control": {
        "law": None,
        "laws": {
            "damping": {"kind": "bdot", "gain_a_m2_s_per_t": 2e6},
            "pitch": {
                "kind": "bias_momentum",
                "bias_momentum_n_m_s": 0.1,
                "pitch_inertia_kg_m2": 1.2,
                "bandwidth_rad_s": 0.05,
                "nutation_gain_a_m2_s_per_t": 1e5,
                "unloading_gain_per_s": 1e-4,
            },
        },
        "modes": {
            "regions": {
                "task": {
                    "states": {
                        "detumble": {
                            "laws": ["damping"],
                            "transitions": [
                                {
                                    "to": "hold",
                                    "when": {"signal": "rate_deg_s", "below": 0.4},
                                    "for_s": 60.0,
                                }
                            ],
                        },
                        "hold": {
                            "laws": ["pitch"],
                            "transitions": [
                                {"to": "safe", "when": {"signal": "rate_deg_s", "above": 20.0}}
                            ],
                        },
                        "safe": {"wheels": "off", "final": True},
                    }
                },
                "light": {
                    "states": {
                        "day": {
                            "transitions": [
                                {"to": "night", "when": {"signal": "sunlit_fraction", "below": 0.4}}
                            ]
                        },
                        "night": {
                            "transitions": [
                                {"to": "day", "when": {"signal": "sunlit_fraction", "above": 0.6}}
                            ]
                        },
                    }
                },
            }
        },
        "sample_s": 1.0,
        "measure_s": 0.0,
        "actuate_s": None,
    },
    "simulation": {"duration_s": 7200.0, "step_s": 0.5, "record_s": 5.0},
}


@pytest.fixture(scope="session")
def switched():
    """A run with two regions of modes; the second of its laws logs two quantities."""
    return simulate(scenario("switched", **SWITCHING))


@pytest.fixture(scope="session")
def report(detumble, tmp_path_factory):
    """Paths of the report of `detumble`, and the parts done as reported."""
    from torquer.report import write_report

    answer = []
    folder = tmp_path_factory.mktemp("report") / "made"
    paths = write_report(detumble, folder, answer.append, plots=True)
    return paths, answer
