"""What may be of a command; what each state means stands in `commands`."""

from typing import Literal, get_args

State = Literal["waiting", "sent", "received", "executed", "refused", "unanswered", "cancelled"]
WAITING, SENT, RECEIVED, EXECUTED, REFUSED, UNANSWERED, CANCELLED = get_args(State)
