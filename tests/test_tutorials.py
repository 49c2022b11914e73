"""Every block of README and the tutorials is executed, page by page, and prints what it shows.

The blocks of a page are executed in their order in a fresh folder that holds a copy of `examples/`,
so each step must follow from those before it; commands of `torquer` are called in this process. A
block with a tag other than `sh`, `python` and `toml` is the output of the last command. A block
that cannot be executed here stands in `NOT_RUN`.
"""

import contextlib
import importlib
import io
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest

import torquer
from torquer.cli import main
from torquer.compile import engine
from torquer.scenario.toml_text import to_toml

ROOT = Path(__file__).parents[1]
# Russian pages have the blocks of the English ones: `test_russian.py` compares them.
TUTORIALS = [
    path.name for path in (ROOT / "docs/tutorials").glob("[!R]*.md") if ".ru." not in path.name
]
PAGES = ["README.md", *sorted(f"docs/tutorials/{name}" for name in TUTORIALS)]
COMMANDS, OUTPUTS = ("sh", "python"), ("", "text", "mermaid")


class Block(NamedTuple):
    """A fenced block: the name of its page, its number there from 0 on, its tag and its text."""

    page: str
    number: int
    tag: str
    text: str


# Pages that take more than twenty seconds: `make gallery` executes them.
SLOW = {
    *(
        "campaign",
        "filter-check",
        "flight-software",
        "from-simulation-to-flight",
        "hold-with-coils",
        "modes",
        "my-gyros-died",
        "my-wheels-died",
    ),
    *("ground", "safe-mode", "telemetry"),
}

# Programs that a block needs besides Python.
_BOARD = ("cc", "arm-none-eabi-gcc", "qemu-system-arm")
TOOLS = {
    ("from-simulation-to-flight", 8): ("cc",),
    **dict.fromkeys((("from-simulation-to-flight", number) for number in (11, 15, 20)), _BOARD),
    ("from-simulation-to-flight", 13): ("cppcheck",),
}

# Blocks that are not executed, and why.
NOT_RUN = {
    ("README", 0): "`make run` and `make test` install packages",
    ("campaign", 4): "a table of members: tests/campaign/test_tables.py flies such",
    ("ground", 20): "what an import says of a recording of another satellite",
    ("modes", 14): "tests/computer/modes/test_hostile_modes.py makes this note and compares it",
    ("my-wheels-died", 0): "hours: every law flies dozens of designs",
    ("my-wheels-died", 1): "hours: 90 000 flights of a day",
    ("my-wheels-died", 2): "the output of the block before",
    ("safe-mode", 4): "minutes: tests/campaign/test_pairs.py flies some of them",
    ("safe-mode", 5): "the output of the block before",
}

# Commands that go on until the page ends, and what they print once they are ready.
IN_BACKGROUND = {("ground", 1): "listening on", ("ground", 3): "Ctrl-C ends it"}

# Commands that end with exit code 1.
FAILING = {("ground", 8), ("telemetry", 3)}

# Commands of whose output the page shows nothing: what counts is what they write.
UNSHOWN = {
    *(("bring-your-own", 2), ("bench", 2), ("campaign", 6), ("campaign", 8), ("campaign", 16)),
    *(("detumble", 2), ("detumble", 3), ("detumble", 4)),
    *(
        ("field", 6),
        ("flight-software", 2),
        ("modes", 15),
        ("modes", 19),
        ("modes", 20),
        ("README", 1),
    ),
    *(("ground", 0), ("ground", 1), ("ground", 3)),
    *(("ground", 13), ("ground", 14), ("ground", 17)),
    *(("from-simulation-to-flight", 8), ("from-simulation-to-flight", 17)),
    *(("smoothing", 0), ("smoothing", 2), ("wheel-layout", 5)),
    *(("wheels-in-flight", 0), ("wheels-in-flight", 2), ("wheels-in-flight", 6)),
    *(("your-own-law", 2), ("your-own-law", 5)),
}

# What becomes of a block of TOML: it is a part of a file ("shows"), a whole file ("writes"), the
# rest of the file that block 0 begins ("ends"), or changes a file, written to another ("changes").
TOML = {
    ("bring-your-own", 0): ("shows", "examples/own_parts.toml"),
    ("campaign", 0): ("shows", "examples/tip_off_campaign.toml"),
    ("campaign", 2): ("changes", "examples/tip_off_campaign.toml", "drawn.toml"),
    ("campaign", 3): ("changes", "examples/tip_off_campaign.toml", "tied.toml"),
    ("campaign", 5): ("changes", "examples/tip_off_campaign.toml", "fractions.toml"),
    ("campaign", 7): ("changes", "examples/tip_off_campaign.toml", "ended.toml"),
    ("campaign", 11): ("changes", "examples/tip_off_campaign.toml", "indices.toml"),
    ("campaign", 12): ("changes", "examples/tip_off_campaign.toml", "double_gain.toml"),
    ("campaign", 15): ("changes", "examples/tip_off_campaign.toml", "stopped.toml"),
    ("flight-software", 3): ("shows", "examples/software/commands.toml"),
    ("flight-software", 4): ("shows", "examples/software/faults.toml"),
    ("flight-software", 12): ("shows", "examples/software/coil_energy.toml"),
    ("flight-software", 13): ("shows", "examples/software/my_software.toml"),
    ("flight-software", 16): ("shows", "examples/software/uplinked.toml"),
    ("ground", 2): ("shows", "examples/software/ground.toml"),
    ("ground", 12): ("shows", "examples/software/commissioning.toml"),
    ("modes", 0): ("writes", "my_satellite.toml"),
    ("modes", 3): ("ends", "my_satellite.toml"),
    ("modes", 6): ("ends", "my_satellite.toml"),
    ("modes", 16): ("changes", "examples/sun_pointing.toml", "guarded.toml"),
    ("modes", 17): ("changes", "examples/sun_pointing.toml", "checked.toml"),
    ("modes", 18): ("shows", "examples/chibis_m_day.toml"),
    ("other-satellite", 0): ("shows", "examples/software/other_packets.toml"),
    ("other-satellite", 1): ("shows", "examples/software/other_satellite.toml"),
    ("passive", 0): ("shows", "examples/passive_magnet.toml"),
    ("several-sensors", 0): ("shows", "examples/several_sensors.toml"),
    ("smoothing", 1): ("changes", "my_satellite.toml", "my_satellite.toml"),
    ("steps", 0): ("changes", "examples/chibis_m_detumble.toml", "tolerant.toml"),
    ("steps", 5): ("changes", "examples/chibis_m_detumble.toml", "fixed.toml"),
    ("wheel-layout", 0): ("shows", "examples/wheels/foton.toml"),
    ("wheels-in-flight", 1): ("shows", "examples/wheels_in_flight.toml"),
    ("wheels-in-flight", 3): ("shows", "examples/turn_to_the_sun.toml"),
    ("wheels-in-flight", 4): ("shows", "examples/turn_to_the_sun.toml"),
    ("wheels-in-flight", 5): ("shows", "examples/looks_at_a_station.toml"),
    ("wheels-in-flight", 7): ("changes", "examples/looks_at_a_station.toml", "waits.toml"),
    ("your-own-law", 1): ("shows", "examples/my_law.toml"),
    ("your-own-law", 4): ("changes", "examples/wheels_in_flight.toml", "my_satellite.toml"),
}

# Tables of an example that are left out when it is changed: a page says so, or has its own.
LEFT_OUT = {("campaign", 2): ("campaign",), ("your-own-law", 4): ("mission",)}

# Blocks of Python that are a file for the blocks after them, too.
FILES = {("campaign", 1): "tip_off.py", ("your-own-law", 3): "brake.py"}

# Outputs of which only some lines are shown.
PARTS = {
    *(
        ("campaign", 14),
        ("field", 5),
        ("wheel-layout", 2),
        ("hold-with-coils", 1),
        ("modes", 5),
        ("modes", 8),
    ),
    *(("from-simulation-to-flight", number) for number in (1, 3, 12, 14, 16, 21)),
    *(("into-a-framework", number) for number in (1, 5, 9)),
    *(("my-gyros-died", number) for number in (3, 5, 7, 9, 11)),
    *(("modes", 12), ("modes", 13), ("safe-mode", 1), ("safe-mode", 3), ("steps", 2)),
}
#: Outputs with shares of flights of which rounding decides some: by how much these may differ [%].
#: Of 568 flights each: code for two kinds of processors, flown on one, differed by up to 2.8.
SHARES = {("my-wheels-died", 4): 4.0}


def blocks_of(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    found = re.findall(r"^```([^\n`]*)\n(.*?)^```[ ]*$", text, re.S | re.M)
    assert 2 * len(found) == len(re.findall(r"^\s*(?:```|~~~)", text, re.M)), page
    name = Path(page).stem
    return [Block(name, number, *each) for number, each in enumerate(found)]


def lines_of(text):
    """Lines that are not empty, as words: tables are as wide as the terminal.

    A drift near 1e-15 is rounding, of which no digit is the same on all processors.
    """
    lines = [
        " ".join(re.sub(r"(^| )(%%|[│─┌┐└┘├┤┬┴]+)(?= |$)", " ", line).split())
        for line in re.sub(r"drift (0|\de-1[4-9])\b", "drift of rounding", text).splitlines()
    ]
    return [line for line in lines if line]


CHANGES = {
    "PYTHONIOENCODING": "utf-8",
    "PYTHONPATH": str(Path(torquer.__file__).parents[1]),
    "MPLBACKEND": "Agg",
    "COLUMNS": "120",
    "BROWSER": "true",  # no window
}
ENVIRONMENT = os.environ | CHANGES


def command_lines(block):
    """The command lines of a block with the programs that they start."""
    for line in block.text.replace("\\\n", " ").splitlines():
        program, *arguments = shlex.split(line, comments=True)
        start = {"torquer": [sys.executable, "-m", "torquer"], "python": [sys.executable]}[program]
        yield line, [*start, *arguments]


def called(arguments):
    """Exit code, standard output and error of a `torquer` command, called in this process."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in "oe")
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        with pytest.raises(SystemExit) as left:
            main(arguments)
        out.flush()
        err.flush()
    return left.value.code or 0, *(each.buffer.getvalue().decode() for each in (out, err))


def run_commands(block):
    """What the commands of a block print; each must succeed."""
    printed = ""
    for line, command in command_lines(block):
        if command[1:3] == ["-m", "torquer"]:
            code, out, err = called(command[3:])
        else:
            done = subprocess.run(command, capture_output=True, env=ENVIRONMENT, encoding="utf-8")
            code, out, err = done.returncode, done.stdout, done.stderr
        assert code == (block[:2] in FAILING), f"{line}\n{out}{err}"
        printed += out
    return printed


@contextlib.contextmanager
def background(block):
    """The command of a block within the block of this context, from when it is ready."""
    ((line, command),) = command_lines(block)
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=ENVIRONMENT,
        encoding="utf-8",
    ) as process:
        printed = ""
        while IN_BACKGROUND[block[:2]] not in printed:
            text = process.stdout.readline()
            assert text, f"{line}\n{printed}"
            printed += text
        try:
            yield
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)


def run_python(block, names):
    path = Path(FILES.get(block[:2], f"block_{block.number}.py"))
    path.write_text(block.text, encoding="utf-8")
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(block.text, str(path.absolute()), "exec"), names)
    return printed.getvalue()


def without_tables(place, base):
    """An example without the tables that a block's page says to leave out."""
    return {key: value for key, value in base.items() if key not in LEFT_OUT.get(place, ())}


def merged(base, change):
    """A table in which the values of another replace those of the same key."""
    both = dict(base)
    for key, value in change.items():
        old = base.get(key)
        inner = isinstance(value, dict) and isinstance(old, dict)
        inner = inner and value.get("kind") in (None, old.get("kind"))
        both[key] = merged(old, value) if inner else value
    return both


def contains(whole, part):
    """Whether tables have all keys of others; tables in a list are there in any place."""
    if isinstance(part, dict):
        return all(key in whole and contains(whole[key], value) for key, value in part.items())
    if isinstance(part, list) and part and isinstance(part[0], dict):
        return all(any(contains(one, each) for one in whole) for each in part)
    return whole == part


def write_toml(block, text_before):
    """Do with a block of TOML what `TOML` says; the file that is written must be accepted."""
    action, *files = TOML[block[:2]]
    if action == "shows":
        whole = tomllib.loads(Path(files[0]).read_text(encoding="utf-8"))
        assert contains(whole, tomllib.loads(block.text))
        return
    if action == "writes":
        text = block.text
    elif action == "ends":
        text = text_before + block.text
    else:
        base = without_tables(block[:2], tomllib.loads(Path(files.pop(0)).read_text("utf-8")))
        text = to_toml(merged(base, tomllib.loads(block.text)))
    path = Path(files[0])
    path.write_text(text, encoding="utf-8")
    load = torquer.load_campaign if "[campaign" in text else torquer.load_scenario
    load(path)


def compare_shares(block, printed):
    """All words that are printed; percentages as far as rounding leaves them alone."""
    percentage = r"\b(\d+\.\d) %"
    lines, shown = (" ".join(lines_of(text)) for text in (printed, block.text))
    assert re.sub(percentage, "%", lines) == re.sub(percentage, "%", shown)
    pairs = zip(re.findall(percentage, lines), re.findall(percentage, shown), strict=True)
    far = [
        (one, other) for one, other in pairs if abs(float(one) - float(other)) > SHARES[block[:2]]
    ]
    assert not far, printed


def compare(block, printed):
    """All words that are printed, or for `PARTS` the lines that are shown, in their order."""
    if block[:2] in SHARES:
        return compare_shares(block, printed)
    lines, shown = lines_of(printed), lines_of(block.text)
    if block[:2] not in PARTS:
        assert " ".join(lines) == " ".join(shown)
        return
    rest = iter(lines)
    for line in shown:
        assert any(each == line for each in rest), f"{line!r} is not printed:\n{printed}"


@pytest.mark.skipif(not engine.COMPILED, reason="whole runs: minutes without JIT")
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=name, marks=[pytest.mark.slow] if name in SLOW else [])
        for page, name in ((page, Path(page).stem) for page in PAGES)
    ],
)
def test_tutorial_blocks_print_the_shown_output(page, tmp_path, monkeypatch):
    importlib.import_module("matplotlib").use("Agg")
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    for name, value in CHANGES.items():
        monkeypatch.setenv(name, value)
    with contextlib.ExitStack() as page_ends:
        missing = run_blocks(blocks_of(page), page_ends)
    if missing:
        pytest.skip(f"all blocks but those that need what is not installed: {', '.join(missing)}")


def run_blocks(blocks, page_ends):
    """Programs that blocks need and that are missing: these blocks and their output are left."""
    names: dict = {"__name__": "__main__"}
    printed: str | None = ""
    missing: list[str] = []
    for block, following in zip(blocks, [*blocks[1:], None], strict=True):
        lacking = [each for each in TOOLS.get(block[:2], ()) if not shutil.which(each)]
        if lacking:
            missing, printed = sorted({*missing, *lacking}), None
        if block[:2] in NOT_RUN or lacking:
            continue
        if block[:2] in IN_BACKGROUND:
            page_ends.enter_context(background(block))
        elif block.tag == "toml":
            write_toml(block, blocks[0].text)
        elif block.tag in COMMANDS:
            printed = run_commands(block) if block.tag == "sh" else run_python(block, names)
            shown = following is not None and following.tag in OUTPUTS
            assert shown or (block[:2] in UNSHOWN) == bool(printed), f"{block[:2]}: {printed}"
        elif printed is not None:
            compare(block, printed)
    return missing


def test_the_lists_of_blocks_name_blocks_that_are_there():
    """Of the right kind; and every block of TOML is named."""
    kinds = {each[:2]: each.tag for page in PAGES for each in blocks_of(page)}
    assert {key for key, tag in kinds.items() if tag == "toml"} == set(TOML)
    assert all(kinds[key] == "python" for key in FILES)
    assert all(kinds[key] in OUTPUTS for key in PARTS)
    assert set(NOT_RUN) | UNSHOWN | FAILING | set(IN_BACKGROUND) <= set(kinds)
    assert all(kinds[key] in OUTPUTS for key in SHARES)
    assert all(kinds[key] in COMMANDS for key in TOOLS)
    assert {Path(page).stem for page in PAGES} >= SLOW
    assert set(kinds.values()) <= {"toml", *COMMANDS, *OUTPUTS}
