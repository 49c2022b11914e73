"""The software file: the user's own modules and packets, and mistakes in one line each."""

import pytest
from onboard_ground import Ground, scenario

from torquer import ScenarioError
from torquer.compile import engine
from torquer.flight.software.core import Core
from torquer.flight.software.modules import MODULES
from torquer.flight.software.software import load_software
from torquer.flight.software.strikes import REQUIRED

MODULE = """
from torquer.flight.packets.reasons import Reason
from torquer.flight.software.modules.module import Module
from torquer.base.spec import Spec


class Settings(Spec):
    gain: float = 2.0


class Dosimeter(Module):
    name = "dosimeter"
    Settings = Settings
    period_s = 5.0

    def __init__(self, settings):
        super().__init__(settings)
        self.dose = 0.0

    def step(self, core):
        self.dose += self.settings.gain * self.period_s
        core.send("dose", (self.dose,))

    def on_clear_dose(self, core, values):
        self.dose = values[0]
        return Reason.DONE
"""
PACKETS = """
[modules]
dosimeter = 200
[down.dose]
id = 200
description = "Dose"
fields = [{ name = "dose", type = "f32", unit = "Gy", description = "dose" }]
[up.clear_dose]
id = 200
module = "dosimeter"
description = "Set the dose"
fields = [{ name = "dose", type = "f32", unit = "Gy", description = "new dose" }]
"""
SOFTWARE = """
packets = ["packets.toml"]
[modules]
tm = {}
[modules.dosimeter]
file = "dosimeter.py"
class = "Dosimeter"
settings = { gain = 3.0 }
"""


@pytest.fixture
def folder(tmp_path):
    """A user's folder with a module, a packet and a software file."""
    for name, text in (
        ("dosimeter.py", MODULE),
        ("packets.toml", PACKETS),
        ("software.toml", SOFTWARE),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.verifies("REQ-COR-007")
@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
def test_a_module_and_a_packet_of_ones_own(folder):
    ground = Ground(Core(scenario(100.0), folder / "software.toml"))
    ground.tick(times=11)
    assert [v["dose"] for v in ground.named("dose")] == [15.0, 30.0, 45.0]
    snapshot = ground.core.snapshot()
    assert ground.command("clear_dose", 1.0)["code"] == 0
    ground.tick(times=5)
    assert ground.named("dose")[-1]["dose"] == 16.0
    ground.core.restore(snapshot)
    again = Ground(ground.core)
    again.tick(times=5)
    assert again.named("dose")[-1]["dose"] == 60.0


def test_the_shipped_software_has_all_modules():
    assert list(load_software().modules) == list(MODULES)


def test_few_modules_are_enough():
    assert set(load_software({}).modules) == set(REQUIRED)


def test_periods_and_settings_are_those_of_the_file(folder):
    own = load_software(folder / "software.toml").modules["dosimeter"]
    assert own.period_s == 5.0 and own.settings.gain == 3.0 and own.on


def changed(folder, name, before, after):
    path = folder / name
    text = path.read_text(encoding="utf-8")
    assert before in text
    path.write_text(text.replace(before, after), encoding="utf-8")


@pytest.mark.verifies("REQ-COR-008")
@pytest.mark.parametrize(
    ("name", "before", "after", "line"),
    [
        ("software.toml", "tm = {}", "tn = {}", "modules.tn: must be one of "),
        ("software.toml", "tm = {}", "tm = { period_s = 0 }", "modules.tm.period_s: must be "),
        ("software.toml", "tm = {}", "tm = { settings = { beacon_s = -1 } }",
         "modules.tm.settings.beacon_s: must be "),
        ("software.toml", "tm = {}", "tm = { settings = { beacon = 1 } }",
         "modules.tm.settings.beacon: must be a known key; received 1 (did you mean beacon_s?)"),
        ("software.toml", "tm = {}", "tm = {}\nsvr = { settings = { silnt_s = 1 } }",
         "modules.svr.settings.silnt_s: must be a known key; received 1 (did you mean silent_s?)"),
        ("software.toml", "packets = [", "packet = [", "packet: must be a known key"),
        ("software.toml", "packets.toml", "none.toml", "none.toml: must be a readable file"),
        ("software.toml", 'class = "Dosimeter"', "", "modules.dosimeter.class: must be given"),
        ("software.toml", "dosimeter.py", "none.py", "modules.dosimeter.file: must be a Python"),
        ("software.toml", '"Dosimeter"', '"Settings"', "modules.dosimeter.class: must be a class"),
        ("software.toml", "[modules]", 'link = "radio"\n[modules]', "link: must be "),
        ("software.toml", "[modules]", 'down_key = "none.key"\n[modules]', "down_key: "),
        ("software.toml", "[modules]", 'up_key = "none.key"\n[modules]',
         "recovery_key: must be given with up_key"),
        ("software.toml", "[modules]", 'recovery_key = "none.key"\n[modules]',
         "up_key: must be given with recovery_key"),
        ("software.toml", "[modules]", "[modules", "software: must be TOML"),
        ("dosimeter.py", "import Spec", "import Spek", "modules.dosimeter.file: must be import"),
        ("dosimeter.py", 'name = "dosimeter"', 'name = "dose"', "modules.dosimeter.class: must ha"),
        ("dosimeter.py", "on_clear_dose", "on_clear",
         "modules.dosimeter: must have a method on_clear_dose"),
        ("packets.toml", "dosimeter = 200", "dosimeter = 3", "packets.toml: modules.dosimeter"),
        ("packets.toml", "dosimeter = 200", "geiger = 200", "packets.toml: up.clear_dose.module"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(folder, name, before, after, line):
    changed(folder, name, before, after)
    with pytest.raises(ScenarioError) as error:
        load_software(folder / "software.toml")
    assert str(error.value).startswith(line) and "\n" not in str(error.value)


def test_a_file_that_is_not_there():
    with pytest.raises(ScenarioError, match="software: must be a readable file"):
        load_software("none.toml")
