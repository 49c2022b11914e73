"""Output of the commands: streams that accept any text, consoles, folders.

A Windows code page, or a pipe in the C locale, lacks the degree sign, Greek, and much of what a
path or a description may contain. Characters with an ASCII transliteration are replaced by it,
all others are escaped, as in `\\u4e2d`; nothing is lost, and nothing raises an error.
"""

import codecs
import os
import re
import sys
import sysconfig
import warnings
from collections.abc import Container, Iterable, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from torquer.base.language import ENGLISH, Verbatim, language, told
from torquer.base.strict_json import json_text

#: ASCII transliterations of the characters that the package itself prints.
PLAIN = {
    "°": " deg", "²": "^2", "³": "^3", "₀": "0", "µ": "u", "μ": "u", "ω": "omega",
    "·": "*", "×": "x", "±": "+-", "−": "-", "–": "-", "—": "-", "…": "...",  # noqa: RUF001
    "’": "'", "‘": "'", "“": '"', "”": '"', "→": "->", "≤": "<=", "≥": ">=", "≈": "~",  # noqa: RUF001
}  # fmt: skip
_ERRORS = "torquer.plain"


def _written_plainly(error: UnicodeError) -> tuple[str, int]:
    """Replacement of characters that an encoding lacks, and where to continue."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return "".join(PLAIN.get(sign) or ascii(sign)[1:-1] for sign in lacking), error.end


def _show_warning(message, category, filename, lineno, file=None, line=None) -> None:
    """A warning of this package as a note, one about the user's own code as a warning.

    What libraries say of their numbers is no note on what the user asked for.
    """
    text, place = harmless(str(message)), Path(filename)
    if category.__module__.partition(".")[0] == _PACKAGE.name:
        shown = told(f"note: {text}")
    elif place.suffix == ".py" and not any(map(place.is_relative_to, _installed())):
        shown = f"warning: {harmless(place.name)}:{lineno}: {text}"
    else:
        return
    with suppress(OSError):
        print(shown, file=file or sys.stderr)


_PACKAGE = Path(__file__).parents[1]


@cache
def _installed() -> tuple[Path, ...]:
    """Folders of this package, of libraries and of Python itself."""
    paths = sysconfig.get_paths()
    return (_PACKAGE, *(Path(paths[key]) for key in ("stdlib", "purelib", "platlib")))


def let_streams_take_any_text() -> None:
    """From now on standard output and error accept any text.

    Characters missing from the font of the pictures appear as boxes, without a warning.
    """
    if not sys.warnoptions:  # whoever asks Python for warnings sees them as it writes them
        warnings.showwarning = _show_warning
    warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font", UserWarning)
    codecs.register_error(_ERRORS, _written_plainly)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # may be None, or replaced by the caller
            stream.reconfigure(errors=_ERRORS)


def finish_output() -> None:
    """Flush the streams, so that an error shows now and not at exit."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()


def drop_output() -> None:
    """Discard output to a closed pipe or a full disk, so that exit does not retry it."""
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:
                stream.flush()
        except (OSError, ValueError):
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


#: Characters that a terminal obeys or that turn text around, but for the end of a line and tabs.
_OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def harmless(text: str) -> str:
    """Untrusted text with everything that controls a terminal written as escapes."""
    return _OBEYED.sub(lambda found: ascii(found[0])[1:-1], text)


def print_error(text: str) -> None:
    """Print lines to standard error, if it can be written."""
    with suppress(OSError):
        for line in harmless(text).split("\n"):
            if line:
                print(f"error: {line}", file=sys.stderr)


def describe_interrupt(out: Path, what: str, there: bool) -> str:
    """What to say of an interrupt; `there`: whether `what` has been written into the folder."""
    kept = f"{what} are in {out}: continue with --resume" if there else "nothing was computed yet"
    return f"interrupted; {kept}"


@contextmanager
def writing_to(out: Path, option: str = "--out", what: str = "folder"):
    """Within the block, report a write error as an error of that folder, or what it is."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise ValueError(
            f"{option}: must be a {what} that can be written; received {out} "
            f"({error.strerror or error})"
        ) from None


#: Folders that the command has made, the inner ones first.
_MADE: list[Path] = []


def make_writable(out: Path, option: str = "--out") -> None:
    """Check, before any work, that the results can be written."""
    with writing_to(out, option):
        _MADE.extend(each for each in (out, *out.parents) if not each.exists())
        out.mkdir(parents=True, exist_ok=True)
        probe = out / ".writable"
        probe.unlink(missing_ok=True)  # a link would be followed
        probe.touch(exist_ok=False)
        probe.unlink()


def forget_made_folders(is_refused: bool) -> None:
    """At the end of a command: one that is refused leaves none of its folders that are empty."""
    for each in _MADE if is_refused else ():
        with suppress(OSError):  # not made, or another's by now
            each.rmdir()
    _MADE.clear()


def save_pictures(figures: dict, out: Path) -> list[str]:
    """Save figures by name into a folder; their paths."""
    from torquer.report.common.figure import save_figure

    make_writable(out)
    with writing_to(out):
        return [str(save_figure(each, out / f"{name}.png")) for name, each in figures.items()]


def show_summary(title: str, rows: Iterable, out: Path, *files: str) -> None:
    """Print labels and values as a table, and the names of the files written into a folder."""
    from rich.table import Table

    shown = Table(title=Verbatim(title), show_header=False, title_justify="left")
    for row in rows:
        shown.add_row(*row)
    console().print(shown)
    print(f"{out}: {', '.join(files)}")


def table(head: Sequence[str], rows: Iterable, title: str = "", left: Container[int] = (0,)):
    """A table; `left`: the columns of words, which are not wrapped. All others are numbers."""
    from rich.box import SIMPLE
    from rich.table import Table

    made = Table(title=title or None, title_justify="left", box=SIMPLE)
    for k, name in enumerate(head):
        if k in left:
            made.add_column(name, no_wrap=True)
        else:
            made.add_column(name, justify="right", overflow="fold")
    for row in rows:
        made.add_row(*row)
    return made


def say(*lines: object) -> None:
    """Print lines in the language of the reader; a path as it is."""
    for line in lines:
        print(harmless(told(line) if isinstance(line, str) else str(line)))


def print_note(text: str) -> None:
    """Print a note to standard error."""
    console(stderr=True).print(f"note: {text}", style="yellow", soft_wrap=True)


def console(stderr: bool = False, **keys):
    """A console for the language of the reader; square brackets and colons are no markup."""
    from rich.console import Console

    class Plain(Console):
        def render_str(self, text: str, **given):
            return super().render_str(harmless(told(text)), **given)

        def on_broken_pipe(self) -> None:
            raise  # the command ends as it does without a console

    return Plain(stderr=stderr, markup=False, emoji=False, highlight=False, **keys)


def table_console(width: int):
    """A console for wide tables: as wide as the terminal, or of a given width without one."""
    screen = console()
    if language() != ENGLISH:  # its heads are longer, and numbers are not to be folded
        width += width // 2
    return screen if screen.is_terminal else console(width=width)


def progress_bar(*columns):
    """A rich progress display on standard error that vanishes when it is done."""
    from rich.progress import BarColumn, Progress, TextColumn

    shown = (TextColumn("{task.description}"), BarColumn(), *columns)
    return Progress(*shown, console=console(stderr=True), transient=True)


@contextmanager
def moving_bar(name: str, given: Sequence[str], *columns: str, total: float | None = None):
    """Callback that moves a bar on a terminal; None elsewhere.

    `given`: what its arguments are, as rich calls it; `columns`: of rich, by name.
    """
    if not sys.stderr.isatty():
        yield None
        return
    from rich import progress

    with progress_bar(*(getattr(progress, each)() for each in columns)) as bar:
        task = bar.add_task(name, total=total)
        yield lambda *values: bar.update(task, **dict(zip(given, values, strict=True)))


def print_answer(
    answer, as_json: bool, out: Path | None = None, files: Sequence[Path] | None = None
) -> int:
    """Print an answer with `data` and `lines`, and which files were written into a folder."""
    if as_json:
        written = {} if files is None else {"files": [str(file) for file in files]}
        print(json_text(answer.data() | written))
        return 0
    say(*answer.lines())
    if files:
        print(f"{out}: {', '.join(file.name for file in files)}")
    return 0


def check_installed(command: str, modules: Sequence[str]) -> None:
    """ValueError for a command whose optional modules are missing."""
    from importlib.util import find_spec

    missing = [name for name in modules if find_spec(name) is None]
    if missing:
        raise ValueError(
            f"{command}: needs {', '.join(missing)}, which `pip install 'torquer[{command}]'` adds"
        )


def show_address(server, folder: Path, no_browser: bool, *more: str) -> None:
    """Print the address of a page, with further lines, and open it in a browser.

    The browser gets a private file in `folder` that leads to the page: whoever lists the processes
    of this machine sees no token.
    """
    import threading
    import webbrowser

    print(server.address, *more, "Ctrl-C ends it", sep="\n", flush=True)
    if no_browser:
        return
    try:
        opener = server.write_opener(folder).as_uri()
    except OSError as error:
        print_note(f"no browser is opened: {folder} takes no private file ({error.strerror})")
        return
    # it may wait for a browser to end, as it does for those in a terminal
    threading.Thread(target=webbrowser.open, args=(opener,), daemon=True).start()


def check_report_options(how) -> None:
    """ValueError for parts of a report that options ask for together with --no-report."""
    for name in ("plots", "page", "figure"):
        if getattr(how, name) and how.no_report:
            raise ValueError(f"--{name}: must not be given with --no-report; received both")


def write_beside_report(result, out: Path, how) -> None:
    """Write what options ask for beside the report of a result: its page of A4, figures."""
    if how.page:
        from torquer.report.common.one_page import save_page
        from torquer.report.one_page import contents

        save_page(contents(result), out)
    if how.figure:
        from torquer.report.paper import write_paper_figures

        write_paper_figures(result, out / "paper")
