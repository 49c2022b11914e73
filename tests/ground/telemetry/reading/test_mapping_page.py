"""The page of mappings: each key has an example, and each example is read as the page says."""

import sqlite3
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest

from torquer.cli.answer import answer
from torquer.ground.telemetry.reading.described import format_rows, mapping_tables, quantity_rows
from torquer.ground.telemetry.reading.epochs import DATES, ORIGINS, YEARS
from torquer.ground.telemetry.reading.mapping import Long, Mapping, load_mapping
from torquer.ground.telemetry.reading.quantities import COLUMNS
from torquer.ground.telemetry.reading.read import read

DOCS = Path(__file__).parents[4] / "docs"
EXAMPLES = tomllib.loads((DOCS / "mapping_examples.toml").read_text(encoding="utf-8"))["example"]


def put(folder, example):
    """The file of an example."""
    text, path = example["file"].lstrip("\n"), folder / "file.csv"
    if "zip" in example:
        with zipfile.ZipFile(path, "w") as archive:
            for name in example["zip"]:
                archive.writestr(name, text)
    elif example.get("archive"):
        put_archive(path, text)
    else:
        path.write_bytes(text.encode(example.get("encode", "utf-8")))
    return path


def put_archive(path, text):
    from torquer.flight.software.software import load_software
    from torquer.ground.archive import Archive

    Archive(path, load_software().dictionary).close()
    head, *rows = text.strip().split("\n")
    with sqlite3.connect(path) as db:
        for row in rows:
            db.execute(
                f"INSERT INTO extended ({head}, _digest, _quality, _status) VALUES ({row}, 0, 2, 0)"
            )


def shown(data):
    """Rows of a session as the page shows them."""
    lines = []
    for k, utc in enumerate(data["utc"].values):
        stamp = np.datetime_as_string(utc, unit="ms").removesuffix(".000") + "Z"
        for name, values in data.data_vars.items():
            numbers = " ".join(f"{each:.6g}" for each in np.atleast_1d(values.values[k]))
            lines.append(f"{stamp} {name} {numbers}")
    return lines


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda each: ", ".join(each["keys"]))
def test_each_example_is_read_as_the_page_says(tmp_path, example):
    (tmp_path / "m.toml").write_text(example["mapping"], encoding="utf-8")
    found = read(put(tmp_path, example), load_mapping(tmp_path / "m.toml")).data
    assert shown(found) == example["read"].strip().split("\n")


def test_each_key_has_an_example_that_holds_it():
    keys = {key for each in EXAMPLES for key in each["keys"]}
    assert keys == {*Mapping.model_fields}
    for each in EXAMPLES:
        assert set(each["keys"]) <= set(tomllib.loads(each["mapping"]))


def test_the_page_lists_all_formats_and_quantities():
    page = (DOCS / "telemetry-mapping.md").read_text(encoding="utf-8")
    assert {row[0].removesuffix("_TICK") for row in format_rows()} == {*ORIGINS, *DATES, *YEARS}
    assert {row[0] for row in quantity_rows()} == {*COLUMNS}
    for name in (*DATES, *YEARS, *COLUMNS, *(f"{each}_TICK" for each in ORIGINS)):
        assert f"| `{name}` |" in page
    for key in (*Mapping.model_fields, *Long.model_fields):
        assert f"| `{key}` |" in page


def test_explain_prints_every_key(capsys):
    assert not answer(["explain", "mapping"])
    printed = capsys.readouterr().out
    for table in mapping_tables()[:1]:
        for key in table.keys:
            assert f"  {key.name} " in printed and key.description.split(".")[0] in printed
    assert not answer(["explain", "mapping.decimal"])
    assert 'Decimal sign, "." or ","' in capsys.readouterr().out
    assert answer(["explain", "nosuchkeyatall"]) == 2
    assert "scenario files, wheel designs or mappings" in capsys.readouterr().err
