"""Notes on a campaign before it is flown: on the values that it lists for a key."""

from collections.abc import Iterator

from torquer.analysis.notes.assess import assess
from torquer.analysis.notes.slip_notes import slip_notes
from torquer.campaign.spec import Campaign
from torquer.scenario.spec import Scenario

#: So many values of a key are looked at.
_MOST = 20


def campaign_notes(scenario: Scenario, campaign: Campaign) -> list[str]:
    """Slips in listed values that the scenario itself does not have, one line each."""
    return [*assess({"the values that vary": _value_notes}, scenario, campaign)]


def _value_notes(scenario: Scenario, campaign: Campaign) -> Iterator[str]:
    own = set(slip_notes(scenario))
    in_lists = {key: each.values for key, each in campaign.vary.items() if each.values}
    for table, lists in (("table", campaign.table), ("vary", in_lists)):
        for key, values in lists.items():
            for value in values[:_MOST]:
                for note in slip_notes(scenario.replace(key, value)):
                    if note not in own:
                        own.add(note)
                        yield f'campaign.{table}."{key}": {note}'
