"""The report on a wheel design as rows of text: terminal, page and notebook show the same."""

import math

from torquer.design.wheel_sweep import Point, Sweep

_AXES = ("x1", "x2", "x3")
#: Rows of the table of a sweep, about.
_SHOWN = 14


def summary_rows(report: dict) -> list[tuple[str, str]]:
    """Label and value for the whole array."""
    held, torque = report["momentum"], report["torque"]
    lost = ", ".join(map(str, report["lost"]))
    rows = [
        ("Wheels", f"{len(report['axes'])}" + (f", failed: {lost}" if lost else "")),
        (
            "Envelope",
            f"{held['vertices']} vertices, {held['edges']} edges, {held['faces']} faces; "
            f"volume {held['volume_n3_m3_s3']:.4g} (N m s)^3",
        ),
        ("Momentum, N m s", _along(held["greatest_n_m_s"], held["worst_direction_n_m_s"])),
        ("Rate, deg/s", _along(held["rate_deg_s"], held["worst_rate_deg_s"])),
    ]
    if torque:
        rows += [
            ("Torque, N m", _along(torque["greatest_n_m"], torque["worst_direction_n_m"])),
            (
                "Acceleration, deg/s^2",
                _along(torque["acceleration_deg_s2"], torque["worst_acceleration_deg_s2"]),
            ),
        ]
    rows += [(f"Demand: {k}", _describe_demand(v)) for k, v in report["demand"].items()]
    rows += [("Would meet them", text) for text in nearest_in_words(report["nearest"])]
    if report["only_given_layout"]:
        rows.append(("Other layouts", f"not compared: {report['only_given_layout']}"))
    return rows + _method_rows(report) + _accumulation_rows(report["accumulation"])


#: What each demand takes of the wheels.
_OF = {"rate": "momentum", "acceleration": "torque", "momentum": "momentum"}


def slews_in_words(demand: dict) -> str:
    """The share of the wheels' momentum and torque that demands take, and which limits."""
    if not demand:
        return ""
    shares = {name: each["share"] for name, each in demand.items()}
    said = " and ".join(f"{_share(share)} of the {_OF[name]}" for name, share in shares.items())
    over = [name for name, each in demand.items() if not each["met"]]
    worst = max(over, key=lambda name: shares[name] or math.inf, default=None)
    return f"; slews take {said}" + (f": the {_OF[worst]} limits" if worst else "")


def _share(share: float | None) -> str:
    return "more than any scale" if share is None else f"{100.0 * share:.3g} %"


def nearest_in_words(found: dict | None) -> list[str]:
    """The changes that meet demands which are not met."""
    if found is None:
        return []
    return [
        *(f"{each['key']} = {_numbers(each['value'])} in place of {_numbers(each['now'])}"
          for each in found["limits"]),
        *(f"the same wheels as {each['name']}, {each['angles']}" for each in found["layouts"]),
    ] or ["no limit of the wheels in this layout, and none of the layouts compared"]  # fmt: skip


def _numbers(value) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(f'{each:.4g}' for each in value)}]"
    return f"{value:.4g}"


def _along(by_axis: dict, worst: float) -> str:
    along = ", ".join(f"{name} {by_axis[name]:.4g}" for name in _AXES)
    return f"{along}; any direction {worst:.4g}"


def _describe_demand(found: dict) -> str:
    if found["share"] is None:
        return "NOT MET: unreachable at any scale"
    return f"{'met' if found['met'] else 'NOT MET'}: {found['share']:.0%} of the array's capability"


def _method_rows(report: dict) -> list[tuple[str, str]]:
    cost, least = report["allocation"], report["least_squares"]
    spent = f"minimax {cost['minimax_us']:.2g} us, pseudo-inverse {cost['least_squares_us']:.2g} us"
    rows = [("Time per allocation", spent)]
    if least:
        rows.insert(0, (
            "Pseudo-inverse reaches",
            f"{least['volume']:.0%} of the envelope's volume; {least['least_extent']:.0%} of its "
            "extent in the worst direction",
        ))  # fmt: skip
    return rows


def _accumulation_rows(found: dict | None) -> list[tuple[str, str]]:
    if not found:
        return []
    cyclic = ", ".join(f"{name} {found['cyclic_n_m_s'][name]:.3g}" for name in _AXES)
    return [
        (
            "Momentum build-up per day",
            f"{found['along_normal_n_m_s_per_day']:.3g} N m s along the orbit normal, "
            f"{found['across_normal_n_m_s_per_day']:.3g} across it",
        ),
        ("Cyclic momentum under the mean torque", f"{cyclic} N m s at most"),
        (
            "Saturation after",
            f"{hours(found['saturation_minimax_h'])} (minimax), "
            f"{hours(found['saturation_least_squares_h'])} (pseudo-inverse)",
        ),
    ]


def hours(value: float | None) -> str:
    """A time in words; None is never."""
    if value is None:
        return "never"
    if value < 0.05:
        return "immediately"
    return f"{value:.1f} h" if value < 240.0 else f"{value / 24.0:.1f} days"


def failure_rows(report: dict) -> tuple[str, tuple, list]:
    """Title, head and rows of the failure table; wheels are numbered from 0."""
    title = "Wheel failures (numbered from 0): guaranteed in any direction; N m s, deg/s, deg/s^2"
    return title, *_grid([_failure(report, case) for case in report["failures"]])


def _failure(report: dict, case: dict) -> dict[str, str]:
    row = {
        "failed wheels": lost_label(case["lost"]),
        "volume": f"{case['volume']:.0%}",
        "momentum": f"{case['worst_direction_n_m_s']:.4g}",
        "rate": f"{case['worst_rate_deg_s']:.4g}",
    }
    if report["torque"] is not None:
        row["acceleration"] = f"{case['worst_acceleration_deg_s2']:.3g}"
    if report["demand"]:
        row["demand"] = _met(case["demand_met"])
    if report["accumulation"] is not None:
        row["saturation"] = hours(case["saturation_h"])
    return row


def _grid(rows: list[dict[str, str]]) -> tuple[tuple[str, ...], list[list[str]]]:
    """Head and rows of a table, from its rows by their heads."""
    return tuple(rows[0]), [[*row.values()] for row in rows]


def _met(demand: bool) -> str:
    return "met" if demand else "not met"


def lost_label(lost) -> str:
    """Numbers of the wheels, from 0."""
    return " + ".join(map(str, lost)) or "none"


def layout_rows(report: dict) -> tuple[str, tuple, list]:
    """Title, head and rows of the table of layouts."""
    title = "Layouts: deg, deg/s"
    title += "; needed for the demand, N m s" if "momentum" in report["demand"] else ""
    title += "; saturation after" if report["accumulation"] is not None else ""
    turned = any(each["angles"].endswith("*") for each in report["layouts"])
    title += "; * along the principal axes, not the body's" if turned else ""
    return title, *_grid([_layout(report, each) for each in report["layouts"]])


def _layout(report: dict, each: dict) -> dict[str, str]:
    row = {
        "layout": each["name"],
        "angles": each["angles"],
        "volume": _part(each["volume_n3_m3_s3"], report["momentum"]["volume_n3_m3_s3"]),
        "rate": f"{each['worst_rate_deg_s']:.4g}",
    }
    if "momentum" in report["demand"]:
        row |= {"norm": _number(each["norm_n_m_s"]), "wheel": _number(each["wheel_n_m_s"])}
    if report["accumulation"] is not None:
        row["minimax"] = hours(each["saturation_minimax_h"])
        row["pseudo-inv."] = hours(each["saturation_least_squares_h"])
    return row


def _part(value: float, whole: float) -> str:
    return f"{value / whole:.0%}" if whole > 0.0 else "-"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def sweep_rows(sweep: Sweep) -> tuple[str, tuple, list]:
    """Title, head and rows of a sweep: some of its points, and the best."""
    last = len(sweep.points) - 1
    shown = {round(last * k / (_SHOWN - 1)) for k in range(_SHOWN)} | {
        sweep.points.index(sweep.best())
    }
    points = [sweep.points[n] for n in sorted(shown)]
    grows = any(point.saturation_h is not None for point in points)
    title = "Sweep: guaranteed in any direction; (N m s)^3, N m s, deg/s"
    return title, *_grid([_sweep_row(sweep.key, point, grows) for point in points])


def _sweep_row(key: str, point: Point, grows: bool) -> dict[str, str]:
    row = {key: f"{point.value:.4g}", "volume": f"{point.volume_n3_m3_s3:.4g}"}
    for able, when in ((point.whole, ""), (point.one_failed, ", one failed")):
        row[f"momentum{when}"] = f"{able.momentum_n_m_s:.4g}"
        row[f"rate{when}"] = f"{able.rate_deg_s:.4g}"
    if point.demand_share is not None:
        row["demand"] = _met(point.demand_share <= 1.0)
    return row | ({"saturation": hours(point.saturation_h)} if grows else {})


def best_in_words(sweep: Sweep) -> str:
    """The highest rate of a sweep, and at which angle."""
    best = sweep.best()
    place = " (an end of the sweep)" if best in (sweep.points[0], sweep.points[-1]) else ""
    return (
        f"highest guaranteed rate of the sweep: {best.whole.rate_deg_s:.4g} deg/s at "
        f"{sweep.key} = {best.value:.4g}{place}; {best.one_failed.rate_deg_s:.4g} deg/s after the "
        "worst single failure"
    )
