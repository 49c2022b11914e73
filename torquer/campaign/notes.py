"""Notes on a campaign before it is flown: on the values that it lists for a key."""

from collections.abc import Iterator

from torquer.analysis.notes.assess import assess
from torquer.analysis.notes.slip_notes import slip_notes
from torquer.campaign.spec import ATTITUDE, Campaign
from torquer.scenario.spec import Scenario

#: So many values of a key are looked at.
_MOST = 20


def campaign_notes(scenario: Scenario, campaign: Campaign) -> list[str]:
    """Slips in listed values that the scenario itself does not have, one line each."""
    return [*assess({"the values that vary": _value_notes}, scenario, campaign)]


def _value_notes(scenario: Scenario, campaign: Campaign) -> Iterator[str]:
    own = set(slip_notes(scenario))
    for key, variation in campaign.vary.items():
        if key == ATTITUDE or not variation.values:
            continue
        for value in variation.values[:_MOST]:
            for note in slip_notes(scenario.replace(key, value)):
                if note not in own:
                    own.add(note)
                    yield f'campaign.vary."{key}": {note}'
