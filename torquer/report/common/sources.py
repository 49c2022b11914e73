"""The part of a page that says what to cite."""

from torquer.analysis.citations import citations, select_sources

HEAD = ("Source", "For")


def source_grid(of) -> tuple[tuple[str, str], list[tuple[str, str]]]:
    """Head and rows: sources of a scenario or result in words, and what calls for them."""
    rows = [(source.in_words(), ", ".join(source.uses)) for source in select_sources(of)]
    return HEAD, rows


def sources_data(of) -> dict:
    """The section as templates take it: a table, and the same as BibTeX."""
    head, rows = source_grid(of)
    return {"head": head, "rows": rows, "bibtex": citations(of)}
