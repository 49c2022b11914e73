"""An estimator of the user's own, from a Python file."""

from pathlib import Path
from typing import ClassVar, Literal

from torquer.base.user_source import cache_beside, import_file
from torquer.computer.blocks.user import UserBlock, find_block
from torquer.computer.estimation.estimator import Estimator


class UserEstimator(UserBlock):
    """An estimator of your own, from a Python file, decorated with `@torquer.estimator`."""

    kind: Literal["user"]
    gives: ClassVar = frozenset({"attitude", "rate"})

    def estimator(self, units=()) -> Estimator:
        """The estimator with these parameters."""
        return self.with_keys(load_estimator(self.file, self.function))


def load_estimator(file: Path, name: str | None = None) -> Estimator:
    """The estimator defined in a user's Python file; by its name when there are several."""
    with cache_beside(file):
        found = find_block(import_file(file, "estimator"), file, name, Estimator, "estimator")
        if not isinstance(found, Estimator):
            raise ValueError(
                f"estimator file {file}: {name} must be decorated with @torquer.estimator; "
                "received a function without it"
            )
        if found.compiled:
            found.in_loop()
    return found
