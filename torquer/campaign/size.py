"""How large a campaign is: time, memory, disk; and that it fits on the disk.

The costs were measured on two cores of a 2020s server; they are meant to a factor of three, as
those of a run are. Whether members fly side by side follows from the scenario and the keys that
vary, as far as it does without laws compiled.
"""

import math
from pathlib import Path
from typing import NamedTuple

from torquer.base.cores import cores
from torquer.campaign.along import FOUND_AT_ONCE, PARTS
from torquer.campaign.fly import CHUNK, CHUNK_S, MOST
from torquer.campaign.joining import BLOCK
from torquer.campaign.outcomes import outcomes_with_series
from torquer.campaign.room import check_room, member_bytes
from torquer.campaign.side_by_side import MOTION_KEYS, TRIED, asks_for_alone, try_key
from torquer.campaign.spec import Campaign
from torquer.compile.lanes import LANES
from torquer.computer.computer import Blocks
from torquer.scenario.spec import Scenario, whole_steps
from torquer.simulation.lanes.group import PIECES, RECORDS, why_alone
from torquer.simulation.lanes.packing import shared_parts
from torquer.simulation.setup.prepare import (
    collect_needs,
    make_dynamics,
    make_plant,
    signals_need,
)
from torquer.simulation.setup.size import (
    BASE_BYTES,
    Size,
    bytes_text,
    piece_steps,
    stepping_s,
    table_bytes,
    tables_s,
    time_text,
)

#: Time of a member's steps in lanes, over that alone.
_IN_LANES = 0.25
#: Time [s] of a member's start in lanes, where more than its motion varies too, and alone; of a
#: record and its signal; of a member on the disk and when it is joined; of a chunk, and the same.
_MOTION_S, _VARIED_S, _ALONE_S, _RECORD_S = 2e-4, 2.2e-4, 5e-3, 3e-7
_STORED_S, _EACH_CHUNK_S = 2e-5, 0.015
#: Numbers of a record in lanes while signals are taken from it; along the orbit.
_NUMBERS, _ALONG = 40, 13
#: Bytes of a member while all are looked at.
_LOOKED_AT_BYTES = 500
#: What is kept of the memory in which tables are made.
_TABLES_KEPT = 0.1
#: Copies of a block of members while it is joined.
_COPIES = 4


class CampaignSize(NamedTuple):
    """What a campaign takes: seconds of so many workers at once, bytes.

    `why_alone`: why members fly one by one; "" if they fly side by side. `disk_bytes`: of
    campaign.nc; while it is made the chunks take as much again.
    """

    runs: int
    workers: int
    why_alone: str
    computing_s: float
    memory_bytes: float
    disk_bytes: float

    @property
    def in_words(self) -> str:
        """Memory, disk and time as a line."""
        together = f"one by one ({self.why_alone})" if self.why_alone else f"{LANES} at a time"
        workers = f"{self.workers} worker{'s' if self.workers > 1 else ''}"
        return (
            f"campaign.nc of about {bytes_text(self.disk_bytes)}, twice while it is made; about "
            f"{bytes_text(self.memory_bytes)} of memory and {time_text(self.computing_s)} of "
            f"{workers}, members {together}"
        )


def checked_campaign_size(
    scenario: Scenario, campaign: Campaign, run: Size, blocks: Blocks
) -> CampaignSize:
    """The size of a campaign, and of its runs `run`; ValueError if the disk here has no room.

    `blocks`: laws and estimators of the scenario.
    """
    check_room(campaign, run.rows, campaign.runs, campaign.runs, Path())
    return estimate_campaign(scenario, campaign, run, blocks)


def estimate_campaign(
    scenario: Scenario, campaign: Campaign, run: Size, blocks: Blocks
) -> CampaignSize:
    """Estimate for a campaign with a worker a core; `run`: of one of its runs alone."""
    why, compiled = _why_alone(scenario, campaign, blocks), blocks.compiled
    workers = min(cores(), math.ceil(campaign.runs / CHUNK))
    member_s = _member_s(scenario, campaign, run, compiled, bool(why))
    tables = tables_s(scenario) * (1.0 if not why else 0.0)
    chunks = math.ceil(campaign.runs / _chunk(campaign, member_s, workers))
    made_again = max(0.0, 1.0 - PIECES / math.ceil(run.steps / piece_steps(scenario)))
    seconds = campaign.runs * (member_s + _STORED_S) + tables
    seconds += chunks * (_EACH_CHUNK_S + made_again * tables)
    of_member = member_bytes(campaign, run.rows)
    memory = BASE_BYTES + workers * _worker_bytes(scenario, run, bool(why))
    memory += _shared_bytes(scenario, run)
    memory += _COPIES * of_member * min(campaign.runs, BLOCK) + _LOOKED_AT_BYTES * campaign.runs
    disk = of_member * campaign.runs
    return CampaignSize(campaign.runs, workers, why, seconds / workers, memory, disk)


def _chunk(campaign: Campaign, member_s: float, workers: int) -> float:
    """Members of a chunk: as many as are flown in some seconds, few enough for all workers."""
    most = min(MOST, CHUNK_S / member_s, campaign.runs / (4 * workers))
    return max(CHUNK, most)


def _why_alone(scenario: Scenario, campaign: Campaign, blocks: Blocks) -> str:
    asked = asks_for_alone(scenario, campaign)
    if asked is not None:
        return asked.why
    why = why_alone(scenario, not blocks.compiled)
    shared = "" if why else _shared_key(scenario, campaign, blocks)
    return f"{shared} varies" if shared else why


def _shared_key(scenario: Scenario, campaign: Campaign, blocks: Blocks) -> str:
    """A key that varies and that members flown together share, as noise; "" if there is none."""
    own = _shared(scenario, blocks)
    for key in campaign.varied_keys:
        if key in MOTION_KEYS:
            continue
        members = [*try_key(scenario, campaign, key)]
        # by itself it may be no scenario
        if len(members) == TRIED and all(_shared(each, blocks) != own for each in members):
            return key
    return ""


def _shared(scenario: Scenario, blocks: Blocks) -> tuple:
    """What members must have alike that fly together, of their devices and their body."""
    plant = make_plant(scenario, collect_needs(blocks) | signals_need(scenario))
    return shared_parts(plant, make_dynamics(scenario, plant))


def _member_s(scenario: Scenario, campaign: Campaign, run: Size, compiled: bool, alone) -> float:
    records_s = _RECORD_S * run.rows * max(1, len(outcomes_with_series(campaign.outcomes)))
    steps_s = stepping_s(scenario, compiled)
    if alone:
        return _ALONE_S + tables_s(scenario) + steps_s + records_s
    started_s = _MOTION_S if MOTION_KEYS.issuperset(campaign.varied_keys) else _VARIED_S
    return started_s + _IN_LANES * steps_s + records_s


def _worker_bytes(scenario: Scenario, run: Size, alone: bool) -> float:
    """Memory of a worker: of a run alone, or of those side by side, with tables of a piece."""
    if alone:
        return run.memory_bytes - BASE_BYTES
    records = min(run.rows, RECORDS)
    tables = table_bytes(scenario, min(run.steps, piece_steps(scenario)))
    return 8.0 * LANES * _NUMBERS * records + tables


def _shared_bytes(scenario: Scenario, run: Size) -> float:
    """Memory of what is tabulated for all members: the orbit's pieces, and records along it."""
    record = whole_steps("record_s", scenario.simulation.record_s, scenario.grid_s)
    steps = min(run.steps, PIECES * piece_steps(scenario))
    along = 8.0 * _ALONG * min(run.steps // record + 1, PARTS * FOUND_AT_ONCE)
    return _TABLES_KEPT * table_bytes(scenario, steps) + along
