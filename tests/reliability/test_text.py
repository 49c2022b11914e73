"""Text from files is shown, never obeyed: terminal, HTML, JSON."""

import json
import math

from torquer.base.strict_json import json_text
from torquer.cli.output import console, harmless


def test_what_a_terminal_obeys_is_written_as_escapes():
    text = "[/red]\x1b[31m bell\x07 turned\u202e back\x9b2J\r over"
    assert harmless(text) == ("[/red]\\x1b[31m bell\\x07 turned\\u202e back\\x9b2J\\r over")
    assert harmless("two\nlines\tand é 中") == "two\nlines\tand é 中"


def test_consoles_and_tables_print_it_so(capsys):
    from rich.table import Table

    table = Table(title="[/red]\x1b[2J")
    table.add_row("[bold]\x1b]0;title\x07", "1")
    console().print(table)
    console().print("\x1b[31mred [/red]")
    out = capsys.readouterr().out
    assert "\x1b[2J" not in out and "\x07" not in out and "\x1b[31m" not in out
    assert "[/red]" in out and "[bold]" in out and "\\x1b" in out


def test_json_has_no_numbers_that_are_none():
    data = {"a": [1.0, math.nan, (math.inf, -math.inf)], "b": {"c": "\x1b"}}
    assert json.loads(json_text(data), parse_constant=lambda name: 1 / 0) == {
        "a": [1.0, None, [None, None]],
        "b": {"c": "\x1b"},
    }
    assert "\x1b" not in json_text(data)


def test_an_error_shows_a_key_with_escapes_as_text(process, tmp_path):
    path = tmp_path / "scenario.toml"
    path.write_text('"\\u001b[31m" = 1\n')
    out, err = process("validate", path).communicate(timeout=60.0)
    assert out == "" and "\x1b" not in err and "\\u001b[31m" in err
