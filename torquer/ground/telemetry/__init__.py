"""Flight and bench data: reading telemetry of unknown quality, its checks, its calibration.

    from torquer.ground.telemetry import TelemetryRequest, check, propose_mapping

Names are imported when first used.
"""

from torquer.base.lazy import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from torquer.ground.telemetry.case import check as check
    from torquer.ground.telemetry.examination import Examination as Examination
    from torquer.ground.telemetry.proposal.propose import (
        NoProposal as NoProposal,
        Proposal as Proposal,
        propose_mapping as propose_mapping,
    )
    from torquer.ground.telemetry.reading.quantities import make_session as make_session
    from torquer.ground.telemetry.request import TelemetryRequest as TelemetryRequest

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
