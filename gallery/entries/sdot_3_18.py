"""SDOT Figs. 3.18 to 3.21: the block diagrams of the logic, drawn from the tables that fly.

The pictures of the source are lost; what its text says of them is asked of the tables, by the
kernel that the simulation runs: thresholds and times where a state is left, and which ways there
are. Fig. 3.18 is the logic of the runs of Figs. 3.16 and 3.17, Figs. 3.19 and 3.20 that of
`examples/chibis_m_flight.toml`, Fig. 3.21 the shipped presets of the automatic logic.
"""

from pathlib import Path

from gallery import logic, sdot_ladder
from gallery.drawing import BLUE, GREEN, GREY, ORANGE, PINK, RED, new_figure
from gallery.entry import Answer, Entry, near, within
from gallery.logic import Logic, draw_table, draw_ways, turning_point, ways
from torquer import load_scenario
from torquer.computer.modes.graph import find_edges
from torquer.computer.modes.spec import Modes
from torquer.scenario.load import presets, scenario_from_data

EXAMPLE = Path(__file__).parents[2] / "examples/chibis_m_flight.toml"
ESTIMATORS = ("field_rate", "triad", "mag_dss", "mag_wrate")
#: Modes of determination and stabilisation by the source's names, and our states of them.
DETERMINATION = {
    "ADS_MODE_SDOT": "sdot", "ADS_MODE_BDOT": "bdot", "ADS_MODE_TRIAD": "triad",
    "ADS_MODE_KALMAN_MAG_DSS": "kalman_mag_dss",
    "ADS_MODE_KALMAN_MAG_DSS_WRATE": "kalman_mag_dss_wrate",
    "ADS_MODE_KALMAN_MAG_WRATE": "kalman_mag_wrate",
    "ADS_MODE_KALMAN_DSS_WRATE": "kalman_dss_wrate", "ADS_MODE_OFF": "aos_off",
}  # fmt: skip
STABILISATION = {
    "ACS_SAFE_PHASE": "safe", "ACS_DETUMB_PHASE": "detumbling", "ACS_3X_PHASE": "acquisition",
    "ACS_SCIENCE_PHASE": "science", "ACS_POINT2DIR_PHASE": "point2dir", "ACS_1X_PHASE": "one_axis",
}  # fmt: skip
#: Ways that the text of 3.4 names for Fig. 3.21.
NAMED = {
    ("waiting", "triad"), ("triad", "kalman_mag_dss"), ("kalman_mag_dss", "kalman_mag_wrate"),
    ("kalman_mag_wrate", "kalman_mag_dss"), ("kalman_mag_dss", "triad"),
    ("kalman_mag_wrate", "triad"), ("bdot", "waiting"), ("triad", "bdot"),
}  # fmt: skip


def sun_pointing() -> Modes:
    """The table of the runs with eclipses and reversal."""
    return scenario_from_data(sdot_ladder.reversing()).control.modes


def flight() -> Modes:
    """All regions of the flight software's example."""
    return load_scenario(EXAMPLE).control.modes


def automatic() -> Modes:
    """The presets of the automatic logic."""
    shipped = presets("region")
    regions = {name: shipped[f"chibis_m_{name}"] for name in ("determination", "stabilisation")}
    return Modes.model_validate({"attitude": {"reference": "inertial"}, "regions": regions})


def _pointing(**known) -> Logic:
    """Sun pointing after a first second."""
    return Logic(sun_pointing(), ("sdot", "damping"))(2, **known)


def _acquiring() -> Logic:
    """The automatic logic in TRIAD, 100 deg off."""
    made = Logic(automatic(), ("damping", "hold", "unload"), ESTIMATORS)
    return made(330, sun_deg=30.0, rate_deg_s=0.2, error_deg=100.0)


def of_sun_pointing() -> tuple:
    """Fig. 3.18: thresholds of the damping, angle, hour and ten minutes of the reversal."""

    def damped(rate):
        return _pointing(rate_deg_s=rate).now("damping")

    def wrong(angle):
        return _pointing(sun_deg=angle)(3610, sun_deg=angle).now("capture")

    turned = _pointing(sun_deg=170.0)
    hour = turned.lasts_s("capture", 5000, sun_deg=170.0)
    spinning = _pointing(rate_deg_s=1.0)
    off = turning_point(lambda rate: Logic.now(spinning(1, rate_deg_s=1.0)(2, rate_deg_s=rate),
                                               "damping") == "on", 1.0, 0.1)  # fmt: skip
    return (
        near("Fig. 3.18: damping begins above", "0.7",
             turning_point(lambda rate: damped(rate) == "off", 0.1, 2.0), "deg/s"),
        near("Fig. 3.18: damping ends below", "0.5", off, "deg/s"),
        near("Fig. 3.18: axis away from the Sun within", "20",
             180.0 - turning_point(lambda angle: wrong(angle) == "watching", 100.0, 179.0), "deg"),
        near("Fig. 3.18: time the wrong way round", "1", hour / 3600.0, "h", 1e-3, "an hour"),
        near("Fig. 3.18: reversal lasts", "10",
             turned.lasts_s("capture", 5000, sun_deg=170.0) / 60.0, "min", 0.05, "10 minutes"),
    )  # fmt: skip


def of_automatic() -> tuple:
    """Fig. 3.21: accuracy at which the filter takes over, age of an attitude, and the ways."""

    def coarse(angle):
        return _acquiring()(20, sun_deg=30.0, rate_deg_s=0.2, error_deg=angle).now("determination")

    def valid(age):
        return _acquiring()(3, sun_deg=30.0, error_deg=100.0, age_s=age).now("determination")

    found = ways(automatic().regions["determination"])
    return (
        near("Fig. 3.21: the Kalman filter takes over from TRIAD below", "60",
             turning_point(lambda angle: coarse(angle) == "triad", 100.0, 5.0), "deg", 0.5,
             "about 60 deg"),
        near("Fig. 3.21: an attitude is out of date after", "10",
             turning_point(lambda age: valid(age) == "triad", 1.0, 100.0), "s", 1.0,
             "more than 10 s"),
        within(f"Fig. 3.21: ways that the text names and the table has, of {len(NAMED)}",
               "B-dot, TRIAD, Kalman in light and shadow, and back", len(NAMED & found),
               low=len(NAMED)),
    )  # fmt: skip


def of_flight() -> tuple:
    """Figs. 3.19, 3.20: modes of the text, and that any way out of order ends in the base mode."""
    regions = flight().regions
    determination, stabilisation = regions["determination"], regions["stabilisation"]
    states = [s for s in determination.states if s not in ("sdot", "aos_off")]
    on_anomaly = {e.leave for e in find_edges(determination)
                  if e.to == "sdot" and _is_raised("anomaly", e.transition)}  # fmt: skip
    follows = {e.leave for e in find_edges(stabilisation)
               if any(c.signal == "in_state" for c in e.transition.when)}  # fmt: skip
    return (
        within("Fig. 3.19: modes of determination of the text that the table has, of "
               f"{len(DETERMINATION)}", "ADS_MODE_...", len(_there(DETERMINATION, determination)),
               low=len(DETERMINATION)),
        within(f"Fig. 3.19: states, of {len(states)}, that an anomaly ends in S-dot",
               "the base mode, entered from any anomaly", len(on_anomaly & set(states)),
               low=len(states)),
        within("Fig. 3.20: modes of stabilisation of the text that the table has, of "
               f"{len(STABILISATION)}", "ACS_..._PHASE", len(_there(STABILISATION, stabilisation)),
               low=len(STABILISATION)),
        within("Fig. 3.20: states that depend on the mode of determination, of "
               f"{len(stabilisation.states)}", "depends directly on the algorithm of determination",
               len(follows), low=len(stabilisation.states)),
    )  # fmt: skip


def _is_raised(flag: str, transition) -> bool:
    """Whether a transition asks that a flag is raised."""
    return any(each.flag == flag and each.above is not None for each in transition.when)


def _there(names: dict, region) -> list[str]:
    return [state for state in names.values() if state in region.states]


def compute() -> Answer:
    """What the text says of each figure, asked of the tables."""
    figures = {
        "sun-pointing": draw_table(sun_pointing(), "S-dot logic (SDOT Fig. 3.18)"),
        "modes": picture(flight()),
        "automatic": draw_table(automatic(), "Automatic logic of Chibis-M (SDOT Fig. 3.21)"),
    }
    all_ = flight().regions
    note = (
        "The block diagrams of the source are lost. Shown are the tables that fly, which were made "
        "from its text: what agrees is that they do what it says. Those of Figs. "
        "3.19 and 3.20 have more than the text: "
        f"{len(find_edges(all_['determination']))} transitions of determination and "
        f"{len(find_edges(all_['stabilisation']))} of stabilisation, drawn by state and cause; all "
        "in words: `torquer modes examples/chibis_m_flight.toml`. Its times and thresholds that "
        "the text does not print are chosen."
    )
    return Answer((*of_sun_pointing(), *of_automatic(), *of_flight()), figures, note)


def picture(modes: Modes):
    """Figs. 3.19, 3.20: states and ways."""
    figure, panels = new_figure("Modes of Chibis-M's flight software (SDOT Figs. 3.19, 3.20)", 2,
                                9.0)  # fmt: skip
    causes = [*logic.CAUSES, "time"]
    colours = dict(zip(causes, (RED, ORANGE, GREEN, PINK, BLUE, GREY), strict=True))
    for axes, name in zip(panels, ("determination", "stabilisation"), strict=True):
        draw_ways(axes, modes.regions[name], colours)
    for cause, colour in colours.items():
        panels[0].plot([], [], color=colour, label=cause)
    panels[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, frameon=False,
                     fontsize=9.0, handlelength=1.2, columnspacing=1.0)  # fmt: skip
    return figure


ENTRY = Entry(
    ids=("SDOT-3.18", "SDOT-3.19", "SDOT-3.20", "SDOT-3.21"),
    compute=compute,
    slow=True,
)
