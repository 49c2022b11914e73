"""Work of `torquer campaign compare`: tables, JSON, report."""

from pathlib import Path

import xarray as xr

from torquer.base.strict_json import json_text
from torquer.campaign.comparison import comparison
from torquer.cli.output import make_writable, table, table_console, writing_to
from torquer.report.campaign.tables import about_comparison, comparison_grid
from torquer.simulation.results.file import load, understood

#: Width of the table where the output is not a terminal.
_WIDTH = 120


def compare(a: Path, b: Path, out: Path | None, as_json: bool) -> int:
    """Print how two campaigns differ; with a folder, also write the report."""
    results = _result_in(a, "A"), _result_in(b, "B")
    with understood(f"{a}, {b}"):
        found = comparison(*results)
    if out is not None:
        from torquer.report.campaign import compare_campaigns

        make_writable(out)
        with writing_to(out):
            compare_campaigns(*results, out)
    if as_json:
        print(json_text(found))
        return 0
    screen = table_console(_WIDTH)
    screen.print(table(*comparison_grid(found)))
    screen.print(about_comparison(found))
    if out is not None:
        print(f"{out}: report.html, plots/")
    return 0


def _result_in(path: Path, name: str) -> xr.Dataset:
    """The campaign of a file, or of the folder it was written to."""
    file = path / "campaign.nc" if path.is_dir() else path
    try:
        result = load(file)
    except OSError as error:
        raise ValueError(
            f"{name}: must be the folder or the campaign.nc of a flown campaign; received "
            f"{path} ({error.strerror or error})"
        ) from None
    if "campaign" not in result.attrs:
        raise ValueError(f"{name}: must be the result of a campaign; received {path}")
    return result
