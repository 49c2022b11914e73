"""The part of a page that says what to cite."""

from torquer.analysis.citations import citations, select_sources
from torquer.base.language import Verbatim, message


def sources_data(of) -> dict:
    """Sources of a scenario or result and what calls for them, as a table and as BibTeX."""
    rows = [(Verbatim(source.in_words()), ", ".join(source.uses)) for source in select_sources(of)]
    return {"head": (message("Source"), message("For")), "rows": rows, "bibtex": citations(of)}
