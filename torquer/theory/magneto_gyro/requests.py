"""What `gyro_models` is asked; the options of `torquer theory magneto-gyro` are the same."""

from typing import Literal

from torquer.base.limits import request


@request
class GyroModelsRequest:
    """What `gyro_models` is asked: GyroModelsRequest(order=15)."""

    order: Literal[12, 15] | None = None
    """Model of stage 1 (12) or of stage 2 (15) alone."""
