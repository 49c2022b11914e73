"""The commands by name: each is imported when it is called or asked for its own help."""

import inspect
import re
from pathlib import Path

from cyclopts import App, Parameter

import torquer
from torquer.cli.examples import show_examples
from torquer.cli.options import as_written

#: Groups of commands that are no command themselves.
GROUPS = {
    "design": "Gains of control laws, coils and benches, from the satellite and its orbit.",
    "export": "The on-board computer of a scenario, for flight.",
    "field": "The geomagnetic field at a point, along an orbit, over the globe, as a cone.",
    "gallery": "Published figures and tables, recomputed and compared with the printed numbers.",
    "kernels": "Compiled kernels for other machines.",
    "session": "Recorded flights of the flight software.",
}
#: Where each command stands in `cli/commands`: its file and its function, or the `app` of a group
#: that is a command itself, with the function that it then calls.
COMMANDS = {
    "board": "board:board",
    "budget": "budget:budget",
    "campaign": "campaign:app:fly",
    "compare": "results:compare",
    "completion": "about:completion",
    "design bench": "design:bench",
    "design coil": "design:coil",
    "design detumble": "design:detumble",
    "design magneto-gyro": "design:magneto_gyro",
    "design mission": "design:mission",
    "design three-axis": "design:three_axis",
    "explain": "explain:explain",
    "export c": "export:c",
    "faults": "faults:faults",
    "field cone": "field:cone",
    "field map": "field:map_",
    "field orbit": "field:orbit",
    "field point": "field:point",
    "filter-check": "filter_check:filter_check",
    "fly": "fly:fly",
    "gallery all": "gallery:all_",
    "gallery list": "gallery:list_",
    "gallery run": "gallery:run",
    "ground": "ground:app:serve",
    "init": "init:init",
    "kernels build": "kernels:build",
    "modes": "modes:modes",
    "packets": "packets:app:packets",
    "run": "run:run",
    "schema": "explain:schema",
    "session bisect": "fly:bisect",
    "session replay": "fly:replay",
    "smooth": "results:smooth",
    "table": "results:table_",
    "telemetry": "telemetry:app:check",
    "theory": "theory:app:theory",
    "validate": "validate:validate",
    "version": "about:version",
    "wheels": "wheels:wheels",
}


def read_help(file: str, function: str) -> str:
    """The docstring of a command, read from its file: importing the command takes longer."""
    source = (Path(__file__).parent / "commands" / f"{file}.py").read_text(encoding="utf-8")
    found = re.search(rf'^def {function}\(.*?\n    """(.*?)"""', source, re.S | re.M)
    return inspect.cleandoc(found[1]) if found else ""


app = App(
    name="torquer",
    help="Satellite attitude control with magnetorquers and reaction wheels.",
    help_epilogue=show_examples(""),
    version=torquer.__version__,
    version_flags=["--version"],
    # no --no-X for each flag X
    default_parameter=Parameter(negative=(), converter=as_written),
    suppress_keyboard_interrupt=False,
)
for _name, _help in GROUPS.items():
    _epilogue = show_examples(_name)
    app.command(App(name=_name, help=_help, help_epilogue=_epilogue, version_flags=[]))
for _words, _place in COMMANDS.items():
    *_group, _name = _words.split()
    _file, _target, *_default = _place.split(":")
    _keys = {} if _default else {"help_epilogue": show_examples(_words)}
    (app[_group[0]] if _group else app).command(
        f"torquer.cli.commands.{_file}:{_target}",
        name=_name,
        help=read_help(_file, _default[0] if _default else _target),
        **_keys,
    )
