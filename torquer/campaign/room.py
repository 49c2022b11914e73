"""The room that the members of a campaign take on the disk."""

from pathlib import Path

from torquer.campaign.outcomes import outcomes_with_series
from torquer.campaign.spec import Campaign
from torquer.simulation.setup.size import bytes_text, free_disk

#: Instants that are kept of a signal.
MOST_INSTANTS = 200
#: Bytes of a member besides its numbers: number, seed, how it ended.
_MEMBER_BYTES = 80


def member_bytes(campaign: Campaign, rows: int) -> float:
    """Bytes of a member in a file: what it drew, its outcomes, and its signals over time.

    `rows`: records of a run.
    """
    signals = len(outcomes_with_series(campaign.outcomes))
    numbers = campaign.unit_numbers + len(campaign.varied_keys) + len(campaign.outcomes)
    return _MEMBER_BYTES + 8.0 * numbers + 4.0 * signals * min(rows, MOST_INSTANTS)


def check_room(campaign: Campaign, rows: int, members: int, missing: int, folder: Path) -> None:
    """ValueError if the disk of a folder has no room for members, of which some are missing there.

    Those take twice their bytes: their chunks stay until all members are joined.
    """
    each = member_bytes(campaign, rows)
    if each * (members + missing) > (there := free_disk(folder.absolute())):
        place = "here" if folder == Path() else f"at {folder}"
        raise ValueError(
            f"campaign.runs: {members} members must fit in the {bytes_text(there)} that are "
            f"free {place}; received a result of about {bytes_text(each * members)}, for a while "
            "twice on the disk"
        )
