"""An estimator of the user's own, from a Python file."""

from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Literal

from torquer.base.user_source import cache_beside, import_file
from torquer.computer.blocks.user import UserBlock, find_block, with_known_function
from torquer.computer.estimation.estimator import Estimator


class UserEstimator(UserBlock):
    """An estimator of your own, from a Python file, decorated with `@torquer.estimator`."""

    kind: Literal["user"]
    place: ClassVar[str] = "control.estimator"
    gives: ClassVar = frozenset({"attitude", "rate"})

    def check_parameters(self) -> None:
        """ValueError for parameters or a memory that the estimator does not have."""
        self.estimator()

    def estimator(self, units=()) -> Estimator:
        """The estimator with these parameters."""
        return self.with_keys(load_estimator(self.file, self.function, self.own_key))


def load_estimator(file: Path, name: str | None, key: str) -> Estimator:
    """The estimator defined in a user's Python file; by its name when there are several.

    `key`: what names the file, as messages begin.
    """
    with cache_beside(file):
        found = find_block(import_file(file, key), file, name, Estimator, key)
        if not isinstance(found, Estimator):
            raise ValueError(
                f"{key}.function: must be decorated with @torquer.estimator; received {name!r} "
                f"of {file}, a function without it"
            )
        found = with_known_function(replace(found, key=key))
        if found.compiled:
            found.in_loop()
    return found
