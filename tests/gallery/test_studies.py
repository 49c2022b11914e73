"""Studies of others: stored results flown again, and what the page says of them."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

from gallery.studies import (
    bar_magnet,
    bar_magnet_page,
    non_monotonic,
    non_monotonic_page,
    pocketqube,
    pocketqube_page,
    single_coil,
    single_coil_page,
    upmsat,
    upmsat_page,
)
from gallery.studies.__main__ import STUDIES, main, page as made_page
from gallery.studies.flying import first_attitude, read
from torquer.compile import engine
from torquer.scenario.load import load_scenario

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")


@pytest.mark.slow
@pytest.mark.parametrize(("case", "law"), [("as published", "plain"), ("as published", "weighted"),
                                           ("converged", "plain")])  # fmt: skip
def test_a_stored_member_flies_again(case, law):
    """To what 1e-13 at the start moves after days: the noise of the sensors decides then.

    That is 0.8 % of the times, and 0.8 % of the last rate of a member that spins up. Members differ
    by 25 %. A flight ends where no axis is faster than 5 deg/s.
    """
    stored = read(pocketqube.NAME)["cases"][case]["rows"][0][law]
    (found,) = pocketqube.flown(case, law, 1)
    assert found.keys() == stored.keys()
    stopped = stored["stopped_h"] is not None
    assert found["greatest_deg_s"] == pytest.approx(
        stored["greatest_deg_s"], rel=1e-5 if stopped else 0.01
    )
    for key in ("stopped_h", "on_h"):
        assert found[key] == (pytest.approx(stored[key], rel=0.02) if stopped else None), key
    if stopped:
        for each in (found, stored):
            assert 4.0 < each["final_deg_s"] < math.sqrt(3.0) * 5.0
    else:
        assert found["final_deg_s"] == pytest.approx(stored["final_deg_s"], rel=0.02)


def test_what_the_page_says_is_what_was_flown():
    """Its paragraph states these in words."""
    for law in pocketqube.LAWS:
        of = {case: pocketqube_page.columns(case, law) for case in pocketqube.CASES}
        stopped = {case: np.isfinite(each["stopped_h"]) for case, each in of.items()}
        assert stopped["as published"].all() and stopped["10 Hz"].all()
        assert stopped["converged"].mean() < 0.1
        late, soon = of["10 Hz"]["stopped_h"], of["as published"]["stopped_h"]
        assert 1.8 < late.mean() / soon[: len(late)].mean() < 2.5
        last = of["converged"]["final_deg_s"]
        assert (last > pocketqube_page.START_DEG_S).mean() > 0.8 and np.median(last) > 700.0
        assert all(len(each["on_h"]) >= 48 for each in of.values())
    for case in ("as published", "10 Hz"):
        saved, error = pocketqube_page.change(case, "on_h")
        assert saved < -10.0 * error


def test_published_numbers_of_the_pocketqube_are_met_within_chance():
    """With as many members, of the same distributions: times to stop, their spread, the saving."""
    for law, (count, _, _, sd, on_h) in pocketqube_page.PUBLISHED.items():
        found = pocketqube_page.columns("as published", law)
        assert len(found["stopped_h"]) == count
        apart, error = pocketqube_page.apart(law)
        assert 0.0 < error < 0.4 and abs(apart) < 3.0 * error
        assert found["stopped_h"].std(ddof=1) == pytest.approx(sd, rel=3.0 / math.sqrt(2.0 * count))
        assert found["on_h"].mean() == pytest.approx(on_h, rel=0.05)
    published = [pocketqube_page.PUBLISHED[law][4] for law in ("plain", "weighted")]
    saved, _ = pocketqube_page.change("as published", "on_h")
    assert saved == pytest.approx(100.0 * (published[1] / published[0] - 1.0), abs=0.5)


def test_the_page_is_the_one_of_the_results():
    page = Path(__file__).parents[2] / "docs" / "studies.md"
    assert page.read_text(encoding="utf-8") == made_page()


def test_steps_damp_by_themselves():
    free = read(pocketqube.NAME)["cases"]["free"]["rows"][0]
    assert pocketqube.damped_part(1.0, "rk4") == pytest.approx(free["rk4"], rel=1e-6)
    assert 0.2 < free["rk4"] < 0.26 and abs(free["splitting"]) < 1e-9


def test_draws_follow_the_published_distributions():
    table = pocketqube.table(200)
    coils = np.array(table["spacecraft.coils.limit_a_m2"])
    assert np.array_equal(coils, table["control.law.parameters.full_a_m2"])
    assert coils.std() == pytest.approx(0.002 / 15.0, rel=0.1) and coils.mean() == pytest.approx(
        0.002, rel=0.02
    )
    inertia = np.array(table["spacecraft.body.inertia_kg_m2"])
    assert all(map(pocketqube.is_body, inertia.tolist()))
    gain = np.array(table["control.law.parameters.gain_a_m2_t_s"])
    assert np.corrcoef(gain, inertia.sum(axis=1))[0, 1] > 0.9  # both of the mass
    nominal = load_scenario(pocketqube.SCENARIO)
    assert pocketqube.gain_a_m2_t_s(nominal.orbit, 0.0002642766798576922) == pytest.approx(
        1.2073916906534135e-06, rel=1e-8
    )


@pytest.mark.parametrize("study", STUDIES.values(), ids=lambda study: study.name)
def test_every_case_was_flown(study):
    flown = read(study.name)["cases"]
    assert flown.keys() == study.cases.keys()
    assert all(case["rows"] and case["torquer"] for case in flown.values())


def test_a_case_that_there_is_not_is_refused(capsys):
    with pytest.raises(SystemExit) as refused:
        main(["bar_magnet", "no such case"])
    assert refused.value.code == 2
    assert "case: must be one of limiting curves" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("law", ["B-cross", "non-monotonic"])
def test_stored_starts_of_the_six_laws_fly_again(law):
    case = non_monotonic.CASES["no noise"]
    starts = {key: values[:2] for key, values in non_monotonic.table(1, case).items()}
    found = non_monotonic.hours_below(
        non_monotonic.of_orbit(1, law, case), starts, non_monotonic.LEFT
    )
    stored = non_monotonic.hours_of("no noise", law)[1, :2]
    assert np.array(found, dtype=float) == pytest.approx(stored, rel=0.02, nan_ok=True)


def test_what_the_page_says_of_six_laws():
    for case in ("no noise", "noise", "isotropic", "residual dipole", "1 Hz"):
        hours = {law: non_monotonic.hours_of(case, law) for law in non_monotonic.LAWS}
        page = non_monotonic_page

        def rank(law, hours=hours, page=page):
            return page.share(hours[law])[0], -page.half_after(hours[law])[0]

        assert max(hours, key=rank) == "non-monotonic", case
    found = {law: non_monotonic.hours_of("no noise", law) for law in non_monotonic.LAWS}
    shares = {law: non_monotonic_page.share(hours) for law, hours in found.items()}
    for law, (published, _) in non_monotonic_page.PUBLISHED.items():
        share, error = shares[law]
        of_theirs = math.sqrt(published * (100 - published) / 100.0)
        assert abs(share - published) <= math.hypot(error, of_theirs), law
    low = {law: non_monotonic.hours_of("low inclination", law) for law in non_monotonic.LAWS}
    assert np.isfinite(low.pop("non-monotonic")).any()
    assert not any(np.isfinite(hours).any() for hours in low.values())
    assert min(shares, key=shares.get) == "B-cross" and non_monotonic.best_factor("B-cross") < 1.0


def test_share_and_median_of_known_times():
    hours = np.array([[0.5, 1.0], [1.5, np.nan]])
    assert non_monotonic_page.share(hours) == pytest.approx((75.0, 25.0))
    assert non_monotonic_page.half_after(hours)[0] == 1.0
    assert non_monotonic_page.half_after(np.full((2, 3), np.nan))[0] == np.inf


@pytest.mark.parametrize("count", bar_magnet.COUNTS)
def test_the_published_time_lies_among_those_of_the_limiting_curves(count):
    """6.5 days; the number of rods and the start are not known."""
    days = bar_magnet.days_of("limiting curves", count)
    assert days.min() < bar_magnet_page.PUBLISHED_DAYS < days.max() < 14.0
    assert not np.isfinite(bar_magnet.days_of("loops within", count)).all()


def test_days_to_settle_of_known_angles():
    """Whole revolutions outside count; once outside at the end is never."""
    angles = np.full(14 * 1440 + 1, 5.0)
    assert bar_magnet.days_to_settle(angles) == 0.0
    angles[1440 + 10] = 11.0
    assert bar_magnet.days_to_settle(angles) == pytest.approx(16 * 96 / 1440.0)
    angles[-2] = 11.0
    assert bar_magnet.days_to_settle(angles) == math.inf


@pytest.mark.slow
@pytest.mark.parametrize("count", bar_magnet.COUNTS)
def test_days_to_settle_are_distributed_as_the_stored_ones(count):
    """A single time is chaotic, their distribution is not.

    The motion itself is checked in `test_studies_independent.py`.
    """
    stored = bar_magnet.days_of("limiting curves", count)
    found = [
        bar_magnet.days_to_settle(bar_magnet.angle_on_limiting_curves(each, 0.5))
        for each in (bar_magnet.with_rods(count, first_attitude(2010, k)) for k in range(12))
    ]
    assert np.isfinite(found).all()
    assert mannwhitneyu(found, stored).pvalue > 1e-3
    slowed = 2.0 * stored
    assert mannwhitneyu(found, slowed).pvalue < 1e-3


def test_what_the_page_says_of_one_coil():
    """The law that predicts detumbles nearly always, B-dot seldom; steps move nothing."""
    for start in single_coil.STARTS:
        share, error = single_coil_page.share(single_coil.minutes_of("predicted", start))
        few, its = single_coil_page.share(single_coil.minutes_of("dead band of 100 nT/s", start))
        assert share - few > 3.0 * np.hypot(error, its) and share > 80.0 and few < 50.0, start
    waited = np.isfinite(single_coil_page.of_all("ten hours")).sum()
    soon = np.isfinite(single_coil_page.of_all("dead band of 100 nT/s")).sum()
    assert soon <= waited < 0.5 * len(single_coil_page.of_all("ten hours"))
    for band in ("B-dot", "dead band of 200 nT/s"):
        assert np.isfinite(single_coil_page.of_all(band)).sum() < 0.2 * soon
    assert single_coil_page.moved_by_steps("dead band of 100 nT/s", "B-dot, precise") < 0.2
    assert single_coil_page.moved_by_steps("predicted", "predicted, precise") < 0.2


def test_share_and_steps_of_known_minutes():
    assert single_coil_page.share(np.array([1.0, np.nan])) == pytest.approx(
        (50.0, 20.412), rel=1e-4
    )
    assert single_coil_page.share(np.full(4, np.nan))[1] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("case", ["dead band of 100 nT/s", "predicted"])
def test_stored_attitudes_of_one_coil_fly_again(case, monkeypatch):
    for start in ("1", "3", "4"):
        monkeypatch.delitem(single_coil.STARTS, start)
    found = [row["2"] for row in single_coil.fly(case, 2)]
    stored = single_coil.minutes_of(case, "2")[:2]
    assert np.array(found, dtype=float) == pytest.approx(stored, rel=1e-3, nan_ok=True)


def test_what_the_page_says_of_upmsat():
    for case in ("tilted dipole", "all of the field", "a tenth of the gain", "on board"):
        assert np.isfinite(upmsat.settled_h(case)).all(), case
    low, high = (
        upmsat.above_wanted("tilted dipole", key).mean() for key in ("least_rad_s", "most_rad_s")
    )
    assert (low, high) == pytest.approx(upmsat_page.EXPECTED_RANGE, abs=0.02)
    rate = upmsat.above_wanted("all of the field", "rate_rad_s").mean()
    assert rate == pytest.approx(2.0, abs=0.01) and rate > upmsat_page.EXPECTED + 0.2
    off = {case: upmsat.column(case, "off_deg").mean() for case in upmsat.CASES}
    assert off["tilted dipole"] < upmsat_page.EXPECTED_DEG < off["all of the field"]
    assert off["a tenth of the gain"] < off["on board"] < off["all of the field"]
    assert off["between cycles"] > 3.0 * off["on board"]
    assert abs(upmsat.column("on board", "sun_moved_deg").mean()) < 0.5
    assert np.isnan(upmsat.settled_h("a hundredth")).sum() > 4
    assert np.isnan(upmsat.settled_h("between cycles")).all()


@pytest.mark.slow
@pytest.mark.parametrize("case", ["all of the field", "on board"])
def test_a_stored_start_of_upmsat_flies_again(case):
    found, stored = upmsat.flown(upmsat.flight(case, 0)), upmsat.read(upmsat.NAME)["cases"][case]
    assert found == pytest.approx(stored["rows"][0], rel=1e-3)
