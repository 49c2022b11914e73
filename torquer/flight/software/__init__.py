"""Flight software around the compiled computer: modules, queues, clock, memory, error log."""

from torquer.lazy import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from torquer.onboard.core import Core as Core
    from torquer.onboard.log import Reason as Reason
    from torquer.onboard.modules.module import Module as Module
    from torquer.onboard.software import load_software as load_software

__getattr__, __dir__, __all__ = lazily(__name__, __file__)
