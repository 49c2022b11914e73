"""The results of a campaign on the disk: a store that grows by a file for each chunk, joined at the
end.

Each file is written whole or not at all, so every file there is complete: a campaign whose process
was killed continues with the chunks that are missing.
"""

import contextlib
import json
import re
import shutil
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import xarray as xr

from torquer.base.user_code import check_unchanged
from torquer.base.validate import as_storable
from torquer.campaign.checks import MEANINGS, column
from torquer.campaign.chunk import COMPLETE, FAILED, Chunk
from torquer.campaign.chunk_files import SUFFIX, load_chunk, save_chunk
from torquer.campaign.contents import outcome_unit, unit_of_signal
from torquer.campaign.fleet import Fleet
from torquer.campaign.joining import in_blocks, numbers_in, write_blocks
from torquer.campaign.outcomes import evaluate_success
from torquer.campaign.provenance import check_same_provenance, provenance
from torquer.scenario.keys import key_unit
from torquer.simulation.results.dataset import law_attributes, part_attributes, versions
from torquer.simulation.results.file import explain_errors, in_bytes, lazily, own_folder
from torquer.simulation.results.restore import are_one_run, check_version, scenario_in

#: Name of the file of a chunk: its first member.
_CHUNK = re.compile(rf"\d{{12}}{re.escape(SUFFIX)}")


def chunk_dataset(fleet: Fleet, chunk: Chunk) -> xr.Dataset:
    """Inputs and outcomes of members, one row each."""
    campaign = fleet.campaign
    variables: dict = {"seed": ("member", chunk.seeds, {"long_name": "seed of the noise"})}
    for key, values in chunk.drawn.items():
        array = _as_array(values)
        dims = ("member", *(f"{key}.axis{k or ''}" for k in range(array.ndim - 1)))
        about = {"role": "input"}
        if array.dtype.kind != "M":  # the units of instants are those of the file
            about["units"] = key_unit(key.rpartition(".")[2])
        variables[key] = (dims, array, about)
    for name in campaign.outcomes:
        variables |= _outcome_variables(fleet, chunk, name)
    for name, values in chunk.checks.items():
        unit, meaning = MEANINGS[name]
        about = {"role": "check", "units": unit, "long_name": meaning}
        variables[column(name)] = ("member", values, about)
    holds = evaluate_success(campaign.success, chunk.outcomes)
    if holds is not None:
        variables["succeeded"] = ("member", holds.astype(np.int8), {"role": "success"})
    how = [COMPLETE if text == COMPLETE else FAILED for text in chunk.ended]
    variables["how_it_ended"] = ("member", np.array(how))
    variables["ended"] = ("member", np.array([*map(as_storable, chunk.ended)]))
    coordinates = {"member": chunk.members, "time": ("time", fleet.kept_s, {"units": "s"})}
    made = xr.Dataset(variables, coordinates, campaign_attributes(fleet))
    for name in campaign.outcomes:
        made[name].attrs["units"] = outcome_unit(made, name)
        if name in chunk.series:
            made[f"series.{name}"].attrs["units"] = unit_of_signal(made, name)
    return made


def _outcome_variables(fleet: Fleet, chunk: Chunk, name: str) -> dict:
    """An outcome, and its signal over time if it is kept."""
    outcome = fleet.campaign.outcomes[name]
    definition = {"signal": _json(outcome.signal), "what": _json(outcome.what)}
    if unit := fleet.log_units.get(str(outcome.signal)):
        definition["signal_units"] = unit
    found: dict = {name: ("member", chunk.outcomes[name], {"role": "outcome", **definition})}
    if name in chunk.series:
        named = outcome.signal if isinstance(outcome.signal, str) else definition["signal"]
        about = {"role": "series", "long_name": named}
        found[f"series.{name}"] = (("member", "time"), chunk.series[name], about)
    return found


def _json(value) -> str:
    return json.dumps(
        value.model_dump(mode="json", exclude_none=True) if hasattr(value, "model_dump") else value
    )


def _as_array(values) -> np.ndarray:
    """Values as an array that a file can hold; tables and lists of different lengths as JSON."""
    if isinstance(values, np.ndarray):
        return values
    if all(isinstance(value, datetime) for value in values):
        naive = [value.astimezone(UTC).replace(tzinfo=None) for value in values]
        return np.array(naive, "datetime64[us]").astype("datetime64[ns]")
    if all(isinstance(value, str) for value in values):
        return np.array([*map(as_storable, values)])
    with contextlib.suppress(ValueError):  # lists of different lengths
        numbers = np.array(values)
        if numbers.dtype.kind in "biuf":
            return numbers
    return np.array([json.dumps(value, default=str) for value in values])


def campaign_attributes(fleet: Fleet) -> dict[str, str]:
    """What is flown, by which laws and which versions."""
    return {
        "scenario": fleet.scenario.model_dump_json(exclude_unset=True),
        "campaign": fleet.campaign.model_dump_json(exclude_none=True),
        "versions": json.dumps(versions()),
        "provenance": json.dumps(provenance()),
        **law_attributes(fleet.base),
        **part_attributes({**fleet.base.files, **fleet.draws}),
    }


def chunks_folder(path: Path) -> Path:
    """Folder of the chunks of an unfinished campaign."""
    return path.with_name(path.name + ".chunks")


#: What all files of a campaign say alike.
ALIKE = ("campaign", "scenario", "versions", "laws", "parts", "provenance")


def is_there(path: Path) -> bool:
    """Whether a campaign, or a part of one, stands at a path; an empty folder is no part."""
    return path.exists() or any(chunks_folder(path).glob("*"))


def remove(path: Path) -> None:
    """Remove a campaign, and what is there of one."""
    path.unlink(missing_ok=True)
    if chunks_folder(path).exists():
        shutil.rmtree(chunks_folder(path))


def check_storable(fleet: Fleet) -> None:
    """NotStorable for members that the file of the campaign cannot hold, whatever they fly."""
    in_bytes(chunk_dataset(fleet, fleet.unflown(np.arange(1))))


def put_chunk(path: Path, data: xr.Dataset) -> None:
    """Write a chunk of the campaign of a file."""
    first = int(data["member"].values[0])
    save_chunk(data, own_folder(chunks_folder(path)) / f"{first:012d}{SUFFIX}")


def chunks_there(path: Path) -> dict[int, Path]:
    """Files of the chunks that are complete, by their first member."""
    found = {}
    for file in sorted(chunks_folder(path).glob("*.*")):
        if file.suffix == ".part":  # of one that was killed while it wrote
            continue
        if not _CHUNK.fullmatch(file.name):
            raise ValueError(
                "to: must have only its own chunks next to it, such as "
                f"000000000128{SUFFIX}; received {file}: remove it, or give it its name back"
            )
        found[int(file.stem)] = file
    return found


def check_arrived(data: xr.Dataset, fleet: Fleet, first: int, last: int) -> None:
    """ValueError for what is not the dataset of members first..last-1, from another process."""
    members = np.arange(first, last)
    expected = chunk_dataset(fleet, fleet.unflown(members))
    for name, part in expected.variables.items():
        wrong = f"where: must return members {first} to {last - 1} of this campaign; received "
        found = data.variables.get(name)
        if found is None or _form(found) != _form(part):
            raise ValueError(f"{wrong}a chunk with another {name}, or with none")
        is_known = part.attrs.get("role") == "input" or name in ("member", "time", "seed")
        if is_known and not part.identical(found):
            raise ValueError(f"{wrong}a chunk with other numbers as {name}")
    for key, text in expected.attrs.items():
        if data.attrs.get(key) != text:
            raise ValueError(f"{wrong}a chunk that states other {key}")


def _form(variable) -> tuple:
    return variable.dims, variable.shape, variable.dtype.kind


def load_members(path: Path, fleet: Fleet) -> Iterator[xr.Dataset]:
    """Members that have been flown, file by file; ValueError for one that cannot be continued."""
    alike: list = []
    for file in files_there(path):
        data = lazily(file) if file == path else load_chunk(file)
        if "member" not in data.coords or not data.sizes["member"] or "campaign" not in data.attrs:
            raise ValueError(f"to: must be the file of a campaign; received {file}")
        said = [data.attrs.get(key) for key in ALIKE]
        if said != alike:  # else it has been checked with a file before it
            with explain_errors(file):
                _check_same(file, data, fleet)
            alike = said
        for name in {"seed", "how_it_ended", "ended", *fleet.campaign.outcomes} - data.keys():
            raise ValueError(f"to: must be the file of a campaign; received {file} without {name}")
        numbers = data["member"].values
        if file != path and int(file.stem) != numbers[0]:
            raise ValueError(
                "to: must have chunks next to it that are named after their first member; received "
                f"{file} with {in_words(numbers)}"
            )
        if numbers.max() >= fleet.campaign.runs:
            raise ValueError(
                f"campaign.runs: must be {numbers.max() + 1} or more, as {file} has so many "
                f"members; received {fleet.campaign.runs}"
            )
        yield data


def in_words(numbers) -> str:
    """Members by their numbers, as "0 to 127, 256": at most four spans."""
    numbers = np.unique(numbers)
    spans = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1) if len(numbers) else []
    shown = [f"{s[0]} to {s[-1]}" if len(s) > 1 else f"{s[0]}" for s in spans[:4]]
    return ", ".join([*shown, *["..."] * (len(spans) > 4)]) or "none"


def files_there(path: Path) -> list[Path]:
    """Files of the members that have been flown: that of the campaign, then its chunks."""
    return [*([path] if path.exists() else []), *chunks_there(path).values()]


def finish_file(path: Path, members: np.ndarray, attributes: Mapping[str, str]) -> xr.Dataset:
    """Join the chunks of some members into the file of the campaign.

    Members that the file has already stay.
    """
    files = files_there(path)
    found = [*map(numbers_in, files)]
    if path.exists():
        members = np.union1d(members, found[0])
    missing = np.setdiff1d(members, np.concatenate([np.zeros(0, np.int64), *found]))
    if len(missing):
        there = len(members) - len(missing)
        raise ValueError(
            f"to: must have all {len(members)} members when they are joined; received {there}, "
            f"without {in_words(missing)}, whose chunks are gone from {chunks_folder(path)}: "
            "resume flies them again"
        )
    whole = write_blocks(in_blocks(files, found, members, attributes), len(members), path)
    shutil.rmtree(chunks_folder(path), ignore_errors=True)
    return whole


def _check_same(path: Path, began: xr.Dataset, fleet: Fleet) -> None:
    """ValueError unless a campaign can continue with the members of a file."""
    check_version(began)
    check_same_provenance(path, began.attrs.get("provenance", "{}"))
    if not are_one_run(scenario_in(began), fleet.scenario):
        raise ValueError(f"scenario: must be the one {path} was started with; received another")
    now = campaign_attributes(fleet)
    _check_table(path, *(json.loads(each["campaign"]) for each in (began.attrs, now)))
    _check_laws(path, *(json.loads(each.get("laws", "{}")) for each in (began.attrs, now)))
    was, this = (json.loads(each.get("parts", "{}")) for each in (began.attrs, now))
    check_unchanged(was, this, f"the one {path} was started with")


def _check_table(path: Path, began: dict, now: dict) -> None:
    """ValueError unless campaigns are the same in what members and their outcomes depend on."""
    if now["sampling"] == "latin_hypercube" and now["runs"] != began["runs"]:
        raise ValueError(
            f"campaign.runs: must be {began['runs']}, as when {path} was started: a Latin "
            f"hypercube is drawn for all its members together; received {now['runs']}"
        )
    for key in sorted((began.keys() | now.keys()) - {"runs", "stop"}):
        was, this = began.get(key), now.get(key)
        if key == "table":  # rows may be added
            was, this = (_rows(each or {}, began["runs"]) for each in (was, this))
        # as texts: the order of keys that vary is that of the numbers of a design
        if json.dumps(was) != json.dumps(this):
            raise ValueError(
                f"campaign.{key}: must be the one {path} was started with; received another"
            )


def _rows(table: dict, count: int) -> dict:
    return {key: values[:count] for key, values in table.items()}


def _check_laws(path: Path, began: dict, now: dict) -> None:
    for key, law in now.items():
        if law["source"] != began.get(key, law)["source"]:
            raise ValueError(
                f"{key} {law['name']}: must be the one {path} was started with; its file, or "
                "one that it imports from its folder, has been edited since"
            )
