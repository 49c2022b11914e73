"""`torquer kernels`: compile now, for machines that shall not compile."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from torquer.cli.options import Json, options


@options
class KernelOptions:
    """Options of `torquer kernels build`."""

    out: Annotated[Path, Parameter(help="Folder for the kernels; must be new or empty.")]
    json: Json = False


def build(*scenarios: Path, how: KernelOptions) -> int:
    """Compile what the runs of SCENARIOS need, for any processor of this kind.

    Where TORQUER_KERNELS names the folder, `torquer` reads its code instead of compiling.
    """
    from torquer.cli.commands import kernels_work

    return kernels_work.build(scenarios, how)
