"""Figures for a paper: size, letters, what can be read, the files."""

import pytest
from artificial_campaign import artificial
from matplotlib.text import Text
from picture_faults import cut_data, off_the_sheet, overlapping

import torquer
from torquer.cli import main
from torquer.design.coil_design import coil
from torquer.design.requests import CoilRequest
from torquer.report.common.paper import save_drawn, save_paper
from torquer.report.theory.designs import draw_coils


def check(figures):
    for name, figure in figures.items():
        assert figure.get_figwidth() * 25.4 == pytest.approx(88.0), name
        assert {each.get_fontsize() for each in figure.findobj(Text) if each.get_text()} == {8.0}
        assert overlapping(figure) == [] == off_the_sheet(figure), name
        assert "cut off" in figure.get_label() or cut_data(figure) == [], name
        assert figure.get_label()


@pytest.mark.parametrize("name", ["detumble", "flown", "alone", "switched"])
def test_a_run(name, request):
    figures = torquer.paper_figures(request.getfixturevalue(name))
    check(figures)
    strips = {each for each in figures if each.startswith("mode_")}
    assert strips == ({"mode_task", "mode_light"} if name == "switched" else set())
    assert "rate_1" in figures


@pytest.mark.parametrize("members", [60, 2])
def test_a_campaign(members, make):
    result = artificial(members, (0,)).assign_attrs(scenario=make().model_dump_json())
    figures = torquer.paper_figures(result)
    check(figures)
    assert figures["distribution_settling_s"].get_label().startswith("Distribution of settling; ")


def test_a_design_is_drawn_as_it_was_and_for_a_column(tmp_path):
    figure = draw_coils(coil(CoilRequest(dipole_a_m2=3.2, diameter_m=0.3, mass_kg=0.2)))
    written = save_drawn({"coils": figure}, tmp_path, "paper")
    assert written == [tmp_path / "coils.png", tmp_path / "paper"]
    check({"coils": figure})
    assert (
        tmp_path / "paper/captions.txt"
    ).read_text() == "coils: 3.2 A m² with 0.2 kg of copper\n"
    assert {each.suffix for each in (tmp_path / "paper").glob("coils.*")} == {
        ".png",
        ".pdf",
        ".svg",
    }
    assert save_drawn({"coils": figure}, tmp_path) == [tmp_path / "coils.png"]


@pytest.mark.parametrize("command", ["three-axis", "detumble", "magneto-gyro"])
def test_a_figure_without_a_folder_is_refused(command, tmp_path, capsys):
    (tmp_path / "s.toml").touch()
    with pytest.raises(SystemExit) as left:
        main(["design", command, str(tmp_path / "s.toml"), "--figure", "paper"])
    assert left.value.code == 2
    assert (
        "--figure: must be given with --out; received paper without it" in capsys.readouterr().err
    )


def test_files_are_the_same_each_time_and_have_outlines_of_letters(detumble, tmp_path):
    figures = torquer.paper_figures(detumble)
    two = {name: figures[name] for name in ("rate_1", "dipoles_2")}
    written = save_paper(two, tmp_path / "paper")
    assert {each.name for each in written} == {
        "captions.txt", *(f"{name}.{kind}" for name in two for kind in ("png", "pdf", "svg"))
    }  # fmt: skip
    before = [each.read_bytes() for each in written]
    again = torquer.paper_figures(detumble)
    written = save_paper({name: again[name] for name in two}, tmp_path / "paper")
    assert [each.read_bytes() for each in written] == before
    assert b"/Subtype /Type3" not in (tmp_path / "paper" / "rate_1.pdf").read_bytes()
    assert "rate_1: Absolute rate\n" in (tmp_path / "paper" / "captions.txt").read_text()
