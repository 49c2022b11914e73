"""WHEEL Figs 10-13: five days in orbit, wheels holding the attitude by a PD law."""

import functools

import numpy as np

from gallery.drawing import BLUE, GREEN, RED, label, new_figure
from gallery.entry import Answer, Entry, Grade, Verdict, chosen, lost, near, within
from gallery.five_days import (
    END_S,
    NONE,
    RECORD_S,
    REST,
    REVOLUTION,
    TURNS,
    Case,
    Flight,
    fly,
    rate_at_start,
    with_steady_torque,
)
from gallery.wheels import LIMIT
from torquer.report.common.figure import quiet
from torquer.spacecraft.wheel_array import angles
from torquer.spacecraft.wheel_array.allocation import allocate
from torquer.spacecraft.wheel_array.layout import WheelArray, four_sided_pyramid

#: Long enough for all to saturate. The law is computed ten times a second for the first reading,
#: as good as continuously; twice a second for the others, which moves their momenta by 0.1 %.
DAYS, FINE_S, COARSE_S = 10.0, 0.1, 0.5
KAPPA = 0.003
BALANCED, PRINTED = (80.5, 45.5), (70.0, 21.5)
#: What f_min = 19.4 = (H1 + H2 + H3)/2, H1 = H2 and H3 = 6.4 H2 imply [N m s].
H3 = 29.6
#: The four readings: whether x1 points against the motion, and the air.
READINGS = {
    "along, at rest": (False, REST),
    "along, turning": (False, TURNS),
    "against, at rest": (True, REST),
    "against, turning": (True, TURNS),
}
FIRST = "along, at rest"
#: kappa and omega0 with which the greatest angle about x3 is 0.50 deg and H3 is 29.6 N m s.
TUNED = {
    "along, at rest": (0.002547, 0.001128049),
    "along, turning": (0.002617, 0.001128254),
    "against, at rest": (0.002520, 0.001127906),
    "against, turning": (0.002445, 0.001127710),
}
#: kappa and omega0 that meet both numbers with H3 against the orbit normal.
OTHER_WAY = {
    "along, at rest": (0.002392, 0.001125170),
    "along, turning": (0.002300, 0.001125398),
    "against, at rest": (0.002377, 0.001125397),
    "against, turning": (0.002456, 0.001125200),
}
#: Evidence for each reading.
_EVIDENCE = (
    "Co-rotating air is supported by V in (6.3), relative to the Earth's surface. Section 7 "
    "supports it, too: there the air rotates, and the growth of H1 and H2 is attributed mainly to "
    "the atmosphere. Air at rest is supported by the sentence after (6.3), and by the 31 h. The "
    "first rotation, by pi/2, of the initial attitude supports x1 along the motion. With three "
    "namings of the orbital axes one such rotation puts x1 on the line of motion and x3 on the "
    "normal. Then x1 points along the motion where the radius is the first or third axis, against "
    "it where the normal is the first. H1, H2 and the greatest momentum of a wheel support x1 "
    "against the motion, in co-rotating air. No reading matches all."
)
#: Momentum [N m s] along the ascending node with which the first reading has the printed numbers.
STEADY = -3.07


def wheels_at(flight: Flight, at) -> np.ndarray:
    """Momenta [N m s] of four wheels at angles (alpha, beta), by the pseudo-inverse."""
    axes = tuple(map(tuple, four_sided_pyramid(*at).tolist()))
    array = WheelArray(axes=axes, momentum_limit_n_m_s=LIMIT)
    return allocate(array, flight.total, "least_squares")[0]


def peak(flight: Flight, at) -> float:
    """Greatest momentum of a wheel in the last revolution of the fifth day."""
    return float(np.abs(flight.at_the_end(wheels_at(flight, at))).max())


def saturated_h(flight: Flight, at) -> float:
    """When the first wheel is at its limit [h]; infinite: not within the flight.

    Between the greatest momenta of two revolutions in a row, so that a small change of the flight
    moves it by a small time and not by a revolution.
    """
    most = np.abs(wheels_at(flight, at)).max(axis=1)
    by_revolution = most[: len(most) // REVOLUTION * REVOLUTION].reshape(-1, REVOLUTION)
    place = by_revolution.argmax(axis=1) + REVOLUTION * np.arange(len(by_revolution))
    full = np.flatnonzero(most[place] >= LIMIT)
    if not full.size:
        return np.inf
    pair = place[full[0] - 1 : full[0] + 1]
    return float(np.interp(LIMIT, most[pair], flight.time_s[pair])) / 3600.0


def later_h(flight: Flight, at=PRINTED) -> float:
    """How much later [h] a wheel is at its limit than at the balanced angles."""
    return saturated_h(flight, at) - saturated_h(flight, BALANCED)


def greatest(flight: Flight) -> np.ndarray:
    """Greatest H1, H2, H3 [N m s] in the last revolution of the fifth day."""
    return np.abs(flight.at_the_end(flight.total)).max(axis=0)


def greatest_angles(flight: Flight) -> np.ndarray:
    """Greatest angles [deg] about x1, x2, x3 after settling, within the five days."""
    return np.abs(flight.settled(flight.angle_deg)).max(axis=0)


def along_node(flight: Flight) -> float:
    """Mean momentum [N m s] along the ascending node in the last revolution of the five days."""
    return float(flight.at_the_end((flight.total * flight.node).sum(axis=1)).mean())


def least_growth(flight: Flight, axis: int) -> float:
    """Least growth [N m s] of the amplitude of H1 or H2 from a day's mean to the next one's."""
    amplitude = 0.5 * np.ptp(flight.by_revolution(flight.total[:, axis]), axis=1)
    days = np.array_split(amplitude, 5)
    return float(np.diff([day.mean() for day in days]).min())


@functools.cache
def flights() -> dict[str, dict[str, Flight]]:
    """All readings: at the same kappa and omega0, with both tuned, and with H3 the other way."""
    same = {name: (KAPPA, rate_at_start()) for name in READINGS}

    def flown(settings):
        return {name: fly(Case(*READINGS[name], *settings[name]), DAYS,
                          FINE_S if settings is same and name == FIRST else COARSE_S)
                for name in READINGS}  # fmt: skip

    return {"same": flown(same), "tuned": flown(TUNED), "other way": flown(OTHER_WAY)}


def compute() -> Answer:
    """The four readings of the text, one of them in detail."""
    made = flights()
    same, tuned, other = made["same"], made["tuned"], made["other way"]
    checks = [*first_reading(same[FIRST])]
    for name, flight in same.items():
        checks.append(near(f"{name}: H3/H2", "6.4", np.divide(*greatest(flight)[[2, 1]])))
        checks += wheels(name, flight)
    for name, flight in tuned.items():
        checks += [_h2(f"{name}, tuned", flight), *wheels(f"{name}, tuned", flight)]
    checks += [_h2(f"{name}, tuned, H3 reversed", flight) for name, flight in other.items()]
    steady = with_steady_torque(tuned[FIRST], STEADY)
    checks += [_h2("with a steady torque", steady), *wheels("with a steady torque", steady)]
    checks = [chosen(check) for check in checks]
    checks += [*of_all([*same.values(), *tuned.values()]), *tuning(tuned, other)]
    return Answer(tuple(checks), figures(made, steady), note(made, steady))


def _h2(name: str, flight: Flight):
    return near(f"{name}: H2", "4.6", greatest(flight)[1], "N m s", printed="4.6 by f_min = 19.4")


def wheels(name: str, flight: Flight):
    """What the wheels of Figs 12 and 13 show."""
    yield within(f"{name}: greatest of a wheel at 80.5, 45.5", "practically 18 N m s",
                 peak(flight, BALANCED), 17.5, 18.0, "N m s")  # fmt: skip
    yield near(f"{name}: at 70.0, 21.5 a wheel saturates later by", "31", later_h(flight), "h", 1.0,
               "about 31 h")  # fmt: skip


def first_reading(flight: Flight):
    """Further checks of x1 along the motion and air at rest."""
    roll, yaw, pitch = greatest_angles(flight)
    h1, h2, h3 = greatest(flight)
    before, after = peak(flight, BALANCED), peak(flight, PRINTED)
    # means over whole revolutions: what is left is the growth alone
    means = flight.by_revolution(flight.total[:, 2]).mean(axis=1)
    return (
        within("greatest about x1", "no more than ±0.005 deg", roll, high=0.0055, unit="deg"),
        within("greatest about x3", "no more than ±0.5 deg", pitch, high=0.55, unit="deg"),
        within("greatest about x2", "no more than ±0.05 deg", yaw, high=0.055, unit="deg"),
        within("least growth of H3 in a revolution", "grows all the time", np.diff(means).min(),
               low=0.0, unit="N m s"),
        lost("H1", h1, "N m s"), lost("H2", h2, "N m s"), lost("H3", h3, "N m s"),
        near("a wheel at 80.5, 45.5 over one at 70.0, 21.5", "1.4", before / after,
             printed="about 1.4"),
    )  # fmt: skip


def of_all(shown):
    """What comes out in every reading, tuned or not."""
    parts = [greatest(flight) for flight in shown]
    grown = [least_growth(flight, axis) for flight in shown for axis in (0, 1)]
    return (
        # momenta printed to 0.1, 4.6 and 4.6, may differ by 2 %
        within("H1 off H2, the most of eight flights", "equal",
               max(abs(h1 / h2 - 1.0) for h1, h2, _ in parts), high=0.02),
        within("growth of the amplitudes of H1 and H2 in a day, least of eight flights",
               "grow all the time", min(grown), low=0.0, unit="N m s"),
    )  # fmt: skip


def tuning(tuned, other):
    """How well the tuned flights meet what they were tuned to."""
    both = [*tuned.values(), *other.values()]
    angle = max(abs(greatest_angles(flight)[2] - 0.5) for flight in both)
    h3 = max(abs(greatest(flight)[2] - H3) for flight in both)
    return (
        chosen(within("tuned: about x3 off 0.50", "0.50 deg", angle, high=0.005, unit="deg")),
        chosen(within("tuned: H3 off 29.6", "29.6 by f_min = 19.4", h3, high=0.05, unit="N m s")),
    )


def note(made, steady: Flight) -> str:
    """What was chosen, what makes H1 to H3, and what speaks for which reading."""
    first = made["same"][FIRST]
    own = angles.least_four_sided(greatest(first))
    return (
        "Lost in the text: (7.2) with its kappa and omega0, and (6.6) with the sense of x1. "
        f"'Along', 'against': x1 and the motion; 'at rest', 'turning': the air. Three things were "
        "chosen with the printed angles in view, and with the momenta 4.6, 4.6 and 29.6 N m s that "
        f"the text implies. They are kappa = {KAPPA:g} 1/s, omega0 = {rate_at_start():.6g} 1/s "
        "(the rate of a circular orbit through the start), and what the law's rates refer to. "
        "'Tuned': kappa and omega0 such "
        "that the greatest angle about x3 is 0.50 deg and H3 = 29.6 N m s, which leaves up to "
        f"{greatest_angles(made['tuned'][FIRST])[0]:.3f} deg about x1. The pictures of angles and "
        f"wheels, and rows that name no reading, are of 'along, at rest'. {_causes(made)} "
        f"{_EVIDENCE} {_steady(steady)} At the best angles of 'along, at rest' itself "
        f"({own[0]:.1f}, {own[1]:.1f}) a wheel saturates {later_h(first, own):.0f} h later than at "
        "80.5, 45.5."
    )


def _causes(made) -> str:
    """What makes H3, H1 and H2."""
    same, other, rate = made["same"], made["other way"], rate_at_start()
    first, nodal = same[FIRST], {name: along_node(flight) for name, flight in same.items()}
    airless = fly(Case(False, NONE, KAPPA, rate), DAYS, COARSE_S)
    instant = fly(Case(*READINGS[FIRST], KAPPA, None), DAYS, COARSE_S)
    return (
        "H3 grows as omega0 is not the mean rate of the orbit: the pitch is then offset by "
        f"{first.settled(first.angle_deg)[:, 2].mean():.3f} deg, on which the gravity gradient "
        "acts. With the rate of the orbit at the instant H3 stays below "
        f"{greatest(instant)[2]:.1f} N m s. H1 and H2 are one momentum along the line of nodes, "
        f"which rotates in the body. Without aerodynamic torque it is {along_node(airless):.2f} N "
        "m s, as the body's spin and H3 rotate with the orbit normal; with air at rest "
        f"{nodal[FIRST]:.2f}. The cross wind of co-rotating air makes it "
        f"{nodal['along, turning']:.1f} with x1 along the motion, {nodal['against, turning']:.1f} "
        "against it. With H3 against the orbit normal spin and H3 nearly cancel: "
        f"{along_node(other[FIRST]):.1f} with air at rest. The amplitude of H1 then grows by "
        f"no more than {least_growth(other[FIRST], 0):.1f} N m s in one of the days. In the text "
        "it grows all the time."
    )


def _steady(flight: Flight) -> str:
    """A torque with which all numbers match."""
    before, after = peak(flight, BALANCED), peak(flight, PRINTED)
    return (
        f"A torque constant in space that adds {STEADY} N m s along the ascending node in the five "
        "days would. It is a quarter of the effect of the cross wind with x1 against the motion. "
        f"With it 'along, at rest', tuned, has H3/H2 = {np.divide(*greatest(flight)[[2, 1]]):.2f}, "
        f"{before:.1f} N m s in a wheel, {before / after:.2f} times less at 70.0, 21.5, where a "
        f"wheel saturates {later_h(flight):.1f} h later."
    )


def figures(made, steady: Flight) -> dict:
    """Angles, momentum, wheels and what the readings give."""
    first = made["same"][FIRST]
    return {
        "": _angles(first),
        "momentum": _momentum(made["same"]),
        "wheels": _wheels(first),
        "readings": _readings(made, steady),
    }


def _of_five_days(flight: Flight):
    shown = slice(0, int(END_S / RECORD_S) + 1, 6)
    return shown, flight.time_s[shown] / 86400.0


def _angles(flight: Flight):
    shown, days = _of_five_days(flight)
    figure, panels = new_figure("Five days: angles off the wanted attitude (WHEEL Fig. 10)", 3, 5.6)
    rows = (("x1 [deg]", 0, 0.005), ("x2 [deg]", 1, 0.05), ("x3 [deg]", 2, 0.5))
    for panel, (name, k, printed) in zip(panels, rows, strict=True):
        panel.plot(days, flight.angle_deg[shown, k], color=BLUE, lw=0.5)
        for side in (-printed, printed):
            panel.axhline(side, color="#555555", lw=0.9, ls=(0, (5, 3)))
        label(panel, "time [days]" if k == 2 else "", f"about {name}", legend=False)
        panel.set(xlim=(0.0, 5.0), ylim=(-1.4 * printed, 1.4 * printed))
    return figure


def _grid(title: str, rows: int, columns: int, height: float):
    """A figure of panels, and the panels (rows, columns); those of a row share the ordinate."""
    figure, (whole,) = new_figure(title, height=height)
    whole.remove()
    panels = figure.subplots(rows, columns, sharey="row", squeeze=False)
    for panel in panels.flat:
        quiet(panel, 9.0)
    return figure, panels


def _days(panels):
    """Panels over the five days: numbers below the last row only."""
    for panel in panels.flat:
        panel.set_xlim(0.0, 5.0)
        panel.tick_params(labelbottom=panel in panels[-1])
    for panel in panels[-1]:
        panel.set_xlabel("time [days]", fontsize=9.5)


def _momentum(same):
    """A column a reading: H1 and H2 have the same range, and would hide each other."""
    figure, panels = _grid("Momentum of all wheels [N m s] (WHEEL Fig. 11), four readings", 3, 4, 6)
    _days(panels)
    for column, (name, flight) in zip(panels.T, same.items(), strict=True):
        shown, days = _of_five_days(flight)
        column[0].set_title(f"x1 {name}", fontsize=9.5)
        for k, (panel, colour) in enumerate(zip(column, (BLUE, RED, GREEN), strict=True)):
            panel.plot(days, flight.total[shown, k], color=colour, lw=0.35)
    for k, panel in enumerate(panels[:, 0]):
        panel.set_ylabel(f"H{k + 1}", fontsize=10)
    return figure


def _wheels(flight: Flight):
    """A row a wheel: opposite ones have the same range, and would hide each other."""
    figure, panels = _grid("Momenta of the wheels [N m s] (WHEEL Figs 12 and 13)", 4, 2, 7.0)
    _days(panels)
    shown, days = _of_five_days(flight)
    for column, at in zip(panels.T, (BALANCED, PRINTED), strict=True):
        momenta = wheels_at(flight, at)[shown]
        column[0].set_title(f"alpha = {at[0]:.1f}, beta = {at[1]:.1f} deg", fontsize=10)
        for k, panel in enumerate(column):
            panel.plot(days, momenta[:, k], color=BLUE, lw=0.45)
            for side in (-LIMIT, LIMIT):
                panel.axhline(side, color="#555555", lw=0.9, ls=(0, (5, 3)))
            panel.set_ylim(-26.0, 26.0)
    for k, panel in enumerate(panels[:, 0]):
        panel.set_ylabel(f"h{k + 1}", fontsize=10)
    return figure


_MARKS = (("same", "one kappa and omega0", "o", BLUE), ("tuned", "both tuned", "s", RED),
          ("other way", "both tuned, H3 reversed", "^", GREEN))  # fmt: skip


def _readings(made, steady: Flight):
    """What the readings give, compared with what is printed."""
    figure, panels = _grid("Readings of the text next to what is printed (dashed)", 1, 3, 3.8)
    shown = (
        ("H2 [N m s]", 4.6, lambda flight: greatest(flight)[1], 22.0),
        ("greatest of a wheel [N m s]", 18.0, lambda flight: peak(flight, BALANCED), 46.0),
        ("saturated later by [h]", 31.0, later_h, 92.0),
    )
    for panel, (words, printed, value, most) in zip(panels[0], shown, strict=True):
        for k, (key, name, marker, colour) in enumerate(_MARKS):
            values = [value(made[key][reading]) for reading in READINGS]
            panel.plot(values, np.arange(4) + 0.22 * (k - 1), marker, color=colour, ms=5.5,
                       mfc="none", mew=1.5, label=name)  # fmt: skip
        panel.plot(value(steady), 4, "s", color=RED, ms=5.5, mfc="none", mew=1.5)
        panel.axvline(printed, color="#555555", lw=0.9, ls=(0, (5, 3)))
        panel.set(xlim=(0.0, most), ylim=(4.5, -0.5), yticks=range(5),
                  yticklabels=[*READINGS, "the first, with\na steady torque"])  # fmt: skip
        panel.set_xlabel(words, fontsize=9.5)
    marks = panels[0, 0].get_legend_handles_labels()
    figure.legend(*marks, loc="outside lower center", ncols=3, frameon=False, fontsize=9.5)
    return figure


ENTRY = Entry(
    ids=("WHEEL-10", "WHEEL-11", "WHEEL-12", "WHEEL-13"),
    compute=compute,
    declared=Verdict.DIFFERS,
    grade=Grade.OPEN,
    reason=(
        "the text leaves four readings open: x1 along or against the motion, air at rest or "
        "turning. With the lost gain and rate chosen for the angles and H3, none matches all. In "
        "air at rest the better layout saturates 28 to 30 h later, but H2 is 7.5 to 7.9 N m s, "
        "where the text's 19.4 and 6.4 imply 4.6. With x1 against the motion, in co-rotating air, "
        "H2 and the greatest momentum of a wheel are nearest, 4.5 to 5.2 and 18.7 to 19.3 N m s, "
        "but the better layout saturates 76 to 84 h later. Which one the source simulated remains "
        "open"
    ),
    slow=True,
)
