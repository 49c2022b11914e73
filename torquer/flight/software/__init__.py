"""Flight software around the compiled computer: modules, queues, clock, memory, error log."""

from torquer.base.lazy import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from torquer.flight.packets.reasons import Reason as Reason
    from torquer.flight.software.core import Core as Core
    from torquer.flight.software.modules.module import Module as Module
    from torquer.flight.software.software import load_software as load_software

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
