"""Notes on a campaign before it is flown: on values that it lists, on keys that change nothing."""

from collections.abc import Iterator

from torquer.analysis.causes import is_read
from torquer.analysis.notes.assess import assess
from torquer.analysis.notes.slip_notes import slip_notes
from torquer.campaign.spec import Campaign
from torquer.scenario.spec import Scenario

#: So many values of a key are looked at.
_MOST = 20


def campaign_notes(scenario: Scenario, campaign: Campaign) -> list[str]:
    """Slips in listed values that the scenario itself does not have, and varied errors of sensors
    that nothing on board reads, one line each."""
    notes = {"the values that vary": _value_notes, "the sensors that vary": _unread_notes}
    return [*assess(notes, scenario, campaign)]


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


def _unread_notes(scenario: Scenario, campaign: Campaign) -> Iterator[str]:
    """What is varied of a device is read by no member, if all have the same computer."""
    if any(key.startswith("control.") for key in campaign.varied_keys):
        return
    for device in scenario.spacecraft.devices():
        if is_read(scenario, device):
            continue
        for key in campaign.varied_keys:
            if key.startswith(f"spacecraft.{device}."):
                yield f"{key} varies, and nothing on board reads it: members do not differ by it"
