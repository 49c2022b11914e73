"""A law of the user's own, from a Python file beside the scenario."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from torquer.control.law import Law, load_law
from torquer.spec import Spec


class UserLaw(Spec):
    """`file`: Python file; `function`: the law in it (may be left out if there is one only);
    `parameters`: values by name, in place of the law's defaults."""

    kind: Literal["user"]
    file: Path
    function: str | None = None
    parameters: dict[str, float] = Field(default_factory=dict)

    def law(self) -> Law:
        """The law, compiled if it is decorated with `@torquer.law`."""
        return load_law(self.file, self.function).with_parameters(**self.parameters)
