"""Runs next to each other, joined runs, derived quantities, pictures in notebooks."""

import json
import os
import signal

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import torquer
from torquer.report import accessor  # noqa: F401  `import torquer` registers it with `simulate`
from torquer.report.common import side_by_side
from torquer.simulation.results.variables import ATTRIBUTES, COORDINATES, VARIABLES
from torquer.simulation.setup.simulate import simulate


@pytest.fixture(scope="module")
def short(make):
    """Twenty minutes of the same satellite with a tenth of the gain, another seed and name."""
    law = {"kind": "bdot", "gain_a_m2_s_per_t": 2e5}
    run = make("weak", control={"law": law}, simulation={"duration_s": 1200.0}, seed=8)
    return simulate(run)


@pytest.fixture(scope="module")
def both(detumble, short):
    return torquer.compare(detumble, short)


# ------------------------------------------------------------------ derived quantities


def test_derived_quantities_are_those_of_the_definition(detumble):
    found = detumble.torquer.derived()
    omega = np.degrees(detumble["omega_body"].values)
    assert found["rate"].values == pytest.approx(np.linalg.norm(omega, axis=1), rel=1e-14)
    assert found["rate"].attrs["units"] == found["rate_body"].attrs["units"] == "deg/s"
    to_inertial = Rotation.from_quat(detumble["q_body_to_inertial"].values)
    sun, momentum = detumble["sun_inertial"].values, detumble["momentum_inertial"].values
    for k, e in enumerate(np.eye(3)):
        cosine = np.sum(to_inertial.apply(e) * sun, axis=1)
        np.testing.assert_allclose(
            np.cos(np.radians(found["sun_angle"].values[:, k])), cosine, atol=1e-12
        )
    diagonal = detumble.torquer.sun_angle([2, 2, 0])
    cosine = np.sum(to_inertial.apply([0.5**0.5, 0.5**0.5, 0.0]) * sun, axis=1)
    np.testing.assert_allclose(np.cos(np.radians(diagonal)), cosine, atol=1e-12)
    # the greatest moment is about z; the momentum is on its side at the end
    cosine = np.sum(to_inertial.apply([0, 0, 1.0]) * momentum, axis=1)
    cosine /= np.linalg.norm(momentum, axis=1)
    nutation = np.cos(np.radians(found["nutation"].values))
    np.testing.assert_allclose(nutation, np.sign(cosine[-1]) * cosine, atol=1e-12)
    assert found["nutation"].values[-1] <= 90.0


def test_what_does_not_apply_is_refused_in_one_line(detumble):
    with pytest.raises(ValueError, match="wheel speed: the satellite must have wheels"):
        detumble.torquer.wheel_speed()
    with pytest.raises(ValueError, match="a built-in law must have held an attitude"):
        detumble.torquer.attitude_error()
    with pytest.raises(ValueError, match="region: must be one of none: the laws of this run"):
        detumble.torquer.mode()
    with pytest.raises(ValueError, match="axis: must be non-zero vectors"):
        detumble.torquer.sun_angle([0, 0, 0])


# ------------------------------------------------------------------ comparison


def test_the_table_has_what_each_summary_says(both, detumble, short):
    rows = {row[0]: row[1:] for row in both.rows()}
    for k, result in enumerate((detumble, short)):
        for label, value in torquer.summary_rows(torquer.summarise(result))[-8:]:
            assert rows[label][k] == value


def test_the_differing_keys_are_those_that_were_changed(both):
    assert both.names == ("detumble", "weak")
    assert both.changed == {
        "seed": [7, 8],
        "control.law.gain_a_m2_s_per_t": [2e6, 2e5],
        "simulation.duration_s": [7200.0, 1200.0],
    }


def test_the_picture_has_a_line_of_each_run(both):
    figure = both.plot()
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "Absolute rate", "Angular momentum",
    ]  # fmt: skip
    for axes in figure.axes:
        assert [text.get_text() for text in axes.get_legend().get_texts()] == ["detumble", "weak"]
        ends = [line.get_xdata()[-1] for line in axes.lines[-2:]]
        assert ends == pytest.approx([120.0, 20.0], rel=0.02)  # minutes
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert both._repr_html_().count("<img") == 1


def test_too_few_and_unnamed_runs_are_refused(detumble):
    with pytest.raises(ValueError, match="results: must be 2 to 6 runs; received 1"):
        torquer.compare(detumble)
    with pytest.raises(ValueError, match="names: must be 2 different names; received a, a"):
        torquer.compare(detumble, detumble, names=["a", "a"])
    assert torquer.compare(detumble, detumble).names == ("detumble 1", "detumble 2")


def test_the_command_prints_the_same(both, detumble, short, tmp_path, capsys):
    from torquer.cli import main

    for name, result in (("a", detumble), ("b", short)):
        (tmp_path / name).mkdir()
        torquer.save(result, tmp_path / name / "result.nc")
    with pytest.raises(SystemExit) as left:
        main(["compare", str(tmp_path / "a"), str(tmp_path / "b" / "result.nc"), "--json"])
    printed = json.loads(capsys.readouterr().out)
    assert not left.value.code and printed["changed"] == both.changed
    assert [run["name"] for run in printed["runs"]] == ["a", "b"]
    with pytest.raises(SystemExit):
        main(["compare", str(tmp_path / "a"), str(tmp_path / "b"), "--out", str(tmp_path)])
    out = capsys.readouterr().out
    assert "control.law.gain_a_m2_s_per_t" in out and "2000000.0" in out
    assert (tmp_path / "compared.png").stat().st_size > 10_000
    refused = (
        ([tmp_path / "a"], "RESULTS: must be 2 to 6"),
        ([tmp_path / "a", tmp_path], "RESULTS: must be folders of runs"),
    )
    for wrong, says in refused:
        with pytest.raises(SystemExit) as left:
            main(["compare", *map(str, wrong)])
        assert left.value.code == 2 and says in capsys.readouterr().err


# ------------------------------------------------------------------ joined runs


def test_joined_runs_keep_their_scenario_and_seed(detumble, short):
    joined = torquer.concat([detumble, short])
    assert joined["seed"].values.tolist() == ["7", "8"]
    assert joined["omega_body"].attrs == detumble["omega_body"].attrs
    for name, whole in (("detumble", detumble), ("weak", short)):
        one = torquer.pick_run(joined, name)
        assert one.torquer.scenario == whole.torquer.scenario
        assert torquer.summarise(one) == torquer.summarise(whole)
        for key in ("omega_body", "b_measured", "sunlit_fraction", "utc", "time"):
            np.testing.assert_array_equal(one[key].values, whole[key].values)
    with pytest.raises(ValueError, match="name: must be one of detumble, weak; received 'x'"):
        torquer.pick_run(joined, "x")
    with pytest.raises(ValueError, match="results: must be one or more"):
        torquer.concat([])


# ------------------------------------------------------------------ notebooks


@pytest.mark.slow
def test_the_accessor_draws_the_pictures_of_the_report(short, tmp_path):
    written = {path.stem for path in torquer.write_report(short, tmp_path, plots=True).values()}
    assert set(dir(short.torquer.plot)) == written - {"report"}
    assert short.torquer.plot.rate()._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(AttributeError, match=r"plot: must be one of overview, .*'wheels'"):
        _ = short.torquer.plot.wheels
    shown = short.torquer._repr_html_()
    assert "Final rate" in shown and "data:image/png;base64," in shown


def test_a_scenario_shows_itself_as_its_file(short):
    import html

    shown = short.torquer.scenario._repr_html_()
    text = html.unescape(shown.removeprefix("<pre>").removesuffix("</pre>"))
    assert torquer.scenario_from_text(text) == short.torquer.scenario


# ------------------------------------------------------------------ side by side


def test_pieces_are_done_side_by_side(tmp_path):
    files = [tmp_path / str(k) for k in range(7)]
    seen = []
    pieces = [lambda file=file: file.write_text(str(os.getpid())) for file in files]
    side_by_side.done_side_by_side(pieces, lambda: seen.append(files[0].exists()), seen.append)
    assert all(file.exists() for file in files) and True in seen and seen[-1] == 1.0
    assert files[0].read_text() == str(os.getpid())


def test_a_share_that_dies_is_done_again_here(tmp_path, monkeypatch):
    monkeypatch.setattr(side_by_side, "_shares", lambda: 2)
    here, done = os.getpid(), []

    def dies():
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        done.append("again")

    side_by_side.done_side_by_side([lambda: done.append("own"), dies], lambda: done.append("last"))
    assert done == ["own", "last", "again"]


def test_an_error_in_a_share_is_raised(monkeypatch):
    monkeypatch.setattr(side_by_side, "_shares", lambda: 2)

    def fails():
        raise ValueError("no such picture")

    with pytest.raises(ValueError, match="no such picture"):
        side_by_side.done_side_by_side([lambda: None, fails], lambda: None)


# ------------------------------------------------------------------ the page of variables

KNOWN = {each.name: each for each in (*COORDINATES, *VARIABLES)}


@pytest.fixture(scope="module")
def estimated(make):
    """Adaptive steps, an estimator, models on board; all that the computer knows is recorded."""
    estimator = {"kind": "rate_from_field", "interval_s": 2.0}
    control = {"estimator": estimator, "ephemeris": {"clock_error_s": 1.0}}
    simulation = {"duration_s": 60.0, "step_s": None, "record_inputs": True}
    return simulate(make("estimated", control=control, simulation=simulation))


def kind_of(name: str, values: xr.Variable) -> str:
    """The name on the page; "" for a log, whose name is the law's."""
    if "flag_meanings" in values.attrs:
        return "mode_REGION"
    return "" if ", logged by " in values.attrs.get("long_name", "") else name


def test_every_variable_of_a_result_is_described(detumble, flown, switched, estimated):
    seen: set[str] = set()
    for result in (detumble, flown, switched, estimated):
        assert set(result.attrs) == set(ATTRIBUTES) - {"ended_by"}  # no condition ended these
        for name, values in result.variables.items():
            if not (kind := kind_of(name, values)):
                continue
            attributes, known = values.attrs, KNOWN[kind]
            found = (values.dims, attributes.get("units", ""), attributes.get("frame", ""))
            assert found == (known.dims, known.units, known.frame), name
            seen.add(kind)
    assert seen == set(KNOWN)  # and nothing is described that there is not
