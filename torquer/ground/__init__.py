"""The ground: archive of telemetry, commands and their answers, contacts with satellites.

    from torquer.ground import Archive, RunningGround, import_recording, load_link

    link = load_link("software.toml")
    archive = Archive("satellite.sqlite", link.dictionary)
    import_recording(link, Path("pass.bin"), archive)     # {"frames": ..., "left_out": [...], ...}
    RunningGround(Path("runs/ground")).send([{"command": "report_status", ...}])

A console for packets: none of this loads Numba, SciPy or a simulation. A satellite whose scenario
is given has more to show: names for commands, modes, orbit and sensors. `torquer.ground.telemetry`
examines telemetry, `torquer.pages.ground` shows it live.
"""

from typing import TYPE_CHECKING

from torquer.base.lazy import lazily

if TYPE_CHECKING:
    from torquer.flight.packets.dictionary import (
        Dictionary as Dictionary,
        load_dictionary as load_dictionary,
    )
    from torquer.flight.packets.dictionary_text import dictionary_toml as dictionary_toml
    from torquer.flight.packets.software_file import SpaceLink as SpaceLink, load_link as load_link
    from torquer.flight.packets.xtce_import import read_xtce as read_xtce
    from torquer.ground.archive import (
        Archive as Archive,
        ArchiveError as ArchiveError,
        dictionary_in as dictionary_in,
        read_only as read_only,
    )
    from torquer.ground.backlog import (
        DownlinkTable as DownlinkTable,
        downlinked as downlinked,
    )
    from torquer.ground.client import RunningGround as RunningGround
    from torquer.ground.commands import Commands as Commands
    from torquer.ground.contact import Contact as Contact, Counters as Counters
    from torquer.ground.elements import (
        orbit_from_file as orbit_from_file,
        orbit_of as orbit_of,
    )
    from torquer.ground.export import export_archive as export_archive
    from torquer.ground.file import (
        Satellite as Satellite,
        SatelliteTable as SatelliteTable,
        load_ground as load_ground,
        make_satellite as make_satellite,
    )
    from torquer.ground.gaps import Gap as Gap, find_gaps as find_gaps
    from torquer.ground.live import Live as Live
    from torquer.ground.passes import (
        doppler as doppler,
        find_passes as find_passes,
        ms_of as ms_of,
    )
    from torquer.ground.past import last_known as last_known
    from torquer.ground.recording import import_recording as import_recording
    from torquer.ground.stations import GroundStation as GroundStation
    from torquer.ground.violations import AlarmRecord as AlarmRecord, read_alarms as read_alarms

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
