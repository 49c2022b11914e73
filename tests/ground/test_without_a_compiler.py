"""A console for packets runs where neither Numba nor SciPy is installed."""

import subprocess
import sys

#: A process that cannot import these, as where they are not installed.
WITHOUT = """
import sys
for name in ("numba", "llvmlite", "scipy", "pandas", "xarray"):
    sys.modules[name] = None
"""
CONSOLE = """
import torquer.ground.export, torquer.ground.history, torquer.ground.recording
import torquer.pages.ground.server
from pathlib import Path
from torquer.flight.packets.commands import Sent
from itertools import count
from torquer.ground import Archive, Commands, Contact, SatelliteTable, read_only, make_satellite
from torquer.ground.archive import Batch

satellite = make_satellite("satellite", SatelliteTable(link="udp:127.0.0.1:10315"))
dictionary = satellite.software.dictionary
archive = Archive(Path(sys.argv[1]), dictionary)
keep = lambda command: archive.store(Batch([], commands=[command]))
commands = Commands(dictionary, satellite.names, keep, count(1).__next__)
sent = Sent(at_s=0.0, command="report_status", values={"module_id": 1})
print(commands.order(sent, "test", 0, None)["state"])
print(*[text for (text,) in read_only(archive.path).execute("SELECT command FROM _commands")])
"""
MISTAKEN = """
from torquer import ScenarioError
from torquer.ground import load_link
try:
    load_link({"link": "laser", "modules": {"tm": {"period": 2.0}}})
except ScenarioError as error:
    print(error)
"""


def run_without(code, *arguments):
    """What a process prints that can import neither Numba nor SciPy."""
    command = [sys.executable, "-c", WITHOUT + code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_a_console_archives_and_commands_without_a_compiler(tmp_path):
    assert run_without(CONSOLE, tmp_path / "archive.sqlite") == ["waiting", "report_status"]


def test_mistakes_in_a_software_file_are_explained_without_a_compiler():
    link, period = run_without(MISTAKEN)
    assert link.startswith(
        "link: must be 'historical', 'protected', 'pus' or 'space_packets'; received 'laser'"
    )
    assert period.startswith("modules.tm.period: must be a known key; received 2.0")
