"""Members of a study flown one by one, several at once; results stored as they come."""

import json
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import xarray as xr

from torquer.base.version import VERSION
from torquer.campaign.fly import fly_campaign
from torquer.campaign.load import campaign_from_data
from torquer.scenario.spec import Scenario

HERE = Path(__file__).parent
#: Folder of campaigns that take long, while they are flown.
UNDER_WAY = HERE.parents[1] / "build" / "studies"


def read(name: str) -> dict:
    """Stored results of a study: `flown` (date), `torquer` (version), `cases`."""
    path = HERE / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"cases": {}}


def store(name: str, case: str, rows: list[dict]) -> None:
    """Put a case's rows, one a member, into the results of a study."""
    data = read(name)
    found = {"flown": datetime.now(UTC).date().isoformat(), "torquer": VERSION, "rows": rows}
    data["cases"][case] = found
    (HERE / f"{name}.json").write_text(as_text(data), encoding="utf-8")


def as_text(data: dict) -> str:
    """Results as JSON, a line for each row."""
    cases = (_case_as_text(case, found) for case, found in data["cases"].items())
    return '{"cases": {\n' + ",\n".join(cases) + "\n}}\n"


def _case_as_text(case: str, found: dict) -> str:
    head = ", ".join(f"{json.dumps(key)}: {json.dumps(found[key])}" for key in ("flown", "torquer"))
    rows = ",\n ".join(json.dumps(row, ensure_ascii=False) for row in found["rows"])
    return f'{json.dumps(case)}: {{{head}, "rows": [\n {rows}]}}'


def fly_all(fly: Callable, members: Iterable) -> list[dict]:
    """What `fly` says of each member, two at a time."""
    with ThreadPoolExecutor(2) as pool:
        return [*pool.map(fly, members)]


def fly_table(
    scenario: Scenario,
    table: dict[str, list],
    outcomes: dict,
    workers: int = 2,
    to: Path | None = None,
) -> xr.Dataset:
    """A campaign of the members of a table, side by side where they can be.

    `to`: the file from which one that was broken off goes on.
    """
    campaign = campaign_from_data({"table": table, "outcomes": outcomes}, scenario)
    return fly_campaign(scenario, campaign, workers=workers, to=to, resume=True)


def first_attitude(year: int, number: int) -> np.ndarray:
    """Quaternion of a start of a study, of its number alone; all attitudes are alike."""
    four = np.random.default_rng([year, number]).standard_normal(4)
    return four / np.linalg.norm(four)


def digits(number: float | None, count: int = 7) -> float | None:
    """A number as it is stored; None for one that there is not."""
    return None if number is None or not np.isfinite(number) else float(f"{number:.{count}g}")
