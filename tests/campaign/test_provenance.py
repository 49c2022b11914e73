"""Workers that would compute other numbers are refused; what they return is looked at."""

import numpy as np
import pytest
from tip_off import SCENARIO, campaign

import torquer
from torquer.campaign import executors, fly, provenance as module
from torquer.campaign.executors import chunk_of_task, task_of
from torquer.campaign.fleet import Fleet
from torquer.campaign.provenance import OtherProvenance, check_provenance, files_named, provenance
from torquer.campaign.store import check_arrived, chunk_dataset
from torquer.compile import engine
from torquer.scenario.load import scenario_from_text

pytestmark = pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
LAW = """
import torquer
from helper import GAIN

@torquer.law
def own(inputs):
    return -GAIN * inputs.omega_x, 0.0, 0.0
"""


@pytest.fixture(scope="module")
def flown():
    """A fleet and the dataset of its first members."""
    scenario = scenario_from_text(SCENARIO)
    fleet = Fleet(scenario, campaign(scenario, runs=8))
    return fleet, chunk_dataset(fleet, fleet.fly(np.arange(4)))


@pytest.fixture
def with_law(tmp_path):
    """A scenario whose law is in a file, which imports another."""
    (tmp_path / "own.py").write_text(LAW)
    (tmp_path / "helper.py").write_text("GAIN = 1.0\n")
    law = f'control = {{ law = {{ kind = "user", file = "{tmp_path}/own.py" }}, sample_s = 1.0 }}'
    lines = [law if line.startswith("control") else line for line in SCENARIO.splitlines()]
    return scenario_from_text("\n".join(lines)), tmp_path


@pytest.mark.parametrize("edit", ["own.py", "helper.py"])
def test_another_copy_of_the_law_or_of_what_it_imports_is_refused(with_law, edit):
    scenario, folder = with_law
    task = task_of(scenario, campaign(scenario, runs=2))
    with (folder / edit).open("a") as file:
        file.write("# another\n")
    with pytest.raises(OtherProvenance, match=rf"control\.law \({folder}/own\.py\), not "):
        chunk_of_task(task, 0, 2)


def test_a_law_that_a_worker_lacks_is_refused(with_law):
    scenario, folder = with_law
    task = task_of(scenario, campaign(scenario, runs=2))
    (folder / "own.py").unlink()
    with pytest.raises(OtherProvenance, match="no such file"):
        chunk_of_task(task, 0, 2)


def test_files_that_vary_and_exports_are_looked_at(with_law, tmp_path):
    scenario, folder = with_law
    vary = {"control.law.file": {"values": [f"{folder}/own.py", f"{folder}/other.py"]}}
    (folder / "other.py").write_text(LAW)
    named = files_named(scenario, campaign(scenario, vary=vary), tmp_path)
    assert {"control.law", "computer"} < named.keys()
    assert f"{folder}/other.py" in named.values()
    (tmp_path / "adcs.c").write_text("int a;\n")
    before = provenance({"computer": str(tmp_path)})
    (tmp_path / "adcs.c").write_text("int b;\n")
    with pytest.raises(OtherProvenance, match="computer"):
        check_provenance(before, provenance({"computer": str(tmp_path)}))


@pytest.mark.parametrize("what", [*provenance()])
def test_each_thing_that_numbers_depend_on_is_named(what):
    expected = provenance()
    check_provenance(expected, provenance())
    with pytest.raises(OtherProvenance, match=r"process \d+ on \S+, which has .* as its ") as error:
        check_provenance({**expected, what: "another"}, provenance())
    assert f"as its {what}, not another" in str(error.value)


def test_the_mark_of_functions_sees_a_last_bit(monkeypatch):
    before, sine = module._functions_mark(), np.sin

    def off(x):
        found = sine(x)
        found[7] = np.nextafter(found[7], 2.0)
        return found

    monkeypatch.setattr(module.np, "sin", off)
    module._functions_mark.cache_clear()
    assert module._functions_mark() != before
    monkeypatch.undo()
    module._functions_mark.cache_clear()
    assert module._functions_mark() == before


def test_the_mark_of_the_package_counts_code_and_data(monkeypatch, tmp_path):
    for name in ("laws.py", "field.shc", "pages/web/page.js", "__pycache__/laws.pyc"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1")
    monkeypatch.setattr(module, "PACKAGE", tmp_path)
    monkeypatch.setattr(module, "are_edited", lambda files: False)
    mark = module.package_mark.__wrapped__
    before = mark()
    for name, counts in (("pages/web/page.js", False), ("__pycache__/laws.pyc", False),
                         ("laws.py", True), ("field.shc", True)):  # fmt: skip
        known = mark()
        (tmp_path / name).write_text("2")
        assert (mark() != known) is counts
    assert mark() != before
    monkeypatch.setattr(module, "are_edited", lambda files: True)
    assert "edited since this process began" in mark()


def test_processes_are_asked_too(monkeypatch):
    """A task that states another package, as if the files had been edited between."""
    scenario = scenario_from_text(SCENARIO)
    told = task_of(scenario, campaign(scenario, runs=8))
    other = (told[0], {**told[1], "package": "another"}, told[2])
    monkeypatch.setattr(executors, "task_of", lambda *given: other)
    with pytest.raises(OtherProvenance, match="as its package, not another"):
        torquer.fly_campaign(scenario, campaign(scenario, runs=8), where="processes", workers=1)


def test_a_campaign_of_another_package_is_not_gone_on_with(monkeypatch, tmp_path):
    monkeypatch.setattr(fly, "CHUNK", 8)
    scenario, path = scenario_from_text(SCENARIO), tmp_path / "campaign.nc"
    torquer.fly_campaign(scenario, campaign(scenario, runs=8), to=path)
    monkeypatch.setattr(module, "package_mark", lambda: "another")
    with pytest.raises(ValueError, match="to: must hold a campaign that was begun with"):
        torquer.fly_campaign(scenario, campaign(scenario, runs=16), to=path, resume=True)


def changed(name, value):
    def change(data):
        values = data[name].values.copy()
        values[0] = value
        return data.assign({name: (data[name].dims, values, data[name].attrs)})

    return change


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda data: data.isel(member=slice(0, 3)), "a chunk with another seed, or with none"),
        (lambda data: data.assign_coords(member=data["member"] + 1), "other numbers as member"),
        (lambda data: data.drop_vars("final_rate_deg_s"), "another final_rate_deg_s, or with none"),
        (lambda data: data.assign(final_rate_deg_s=data["final_rate_deg_s"].astype(str)),
         "another final_rate_deg_s"),
        (changed("seed", 1), "other numbers as seed"),
        (changed("initial.rate_deg_s", 1.0), "other numbers as initial.rate_deg_s"),
        (lambda data: data.assign_attrs(laws="{}"), "a chunk that states other laws"),
        (lambda data: data.assign_attrs(versions="{}"), "a chunk that states other versions"),
        (lambda data: data.assign_attrs(provenance="{}"), "a chunk that states other provenance"),
    ],
    ids=range(9),
)  # fmt: skip
def test_what_comes_from_elsewhere_is_compared(flown, change, expected):
    fleet, data = flown
    check_arrived(data, fleet, 0, 4)
    with pytest.raises(ValueError, match=r"^where: must return members 0 to 3 of this") as error:
        check_arrived(change(data), fleet, 0, 4)
    assert expected in str(error.value)
