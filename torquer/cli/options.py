"""Options that several commands have."""

from typing import Annotated

from cyclopts import Parameter

Json = Annotated[bool, Parameter(help="Print machine-readable JSON.", negative="")]
NoReport = Annotated[bool, Parameter(help="Write no report and no pictures.", negative="")]
NoUserCode = Annotated[
    bool, Parameter(help="Refuse laws in Python files, which are executed.", negative="")
]
CodeFromAnywhere = Annotated[
    bool, Parameter(help="Allow laws in files outside SCENARIO's folder.", negative="")
]
