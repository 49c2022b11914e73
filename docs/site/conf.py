"""The documentation site: `make docs`. Its pages are the Markdown files of the repository."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "docs"), str(Path(__file__).parent)]

import pages  # noqa: E402

from torquer.base.version import VERSION  # noqa: E402

project = "torquer"
release = version = VERSION
root_doc = "README"
include_patterns = ["*.md", "docs/*.md", "docs/**/*.md", "design/*.md"]
exclude_patterns = [".*", "build", "runs", "torquer", "tests", "**/node_modules"]

extensions = ["myst_parser", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "html_image"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
highlight_language = "none"
# all files come with the site: it makes no request to anywhere
mathjax_path = "mathjax/tex-svg-full.js"
mathjax_options = {"async": "async"}

html_theme = "furo"
html_title = f"torquer {VERSION}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
templates_path = []


def setup(app):
    """Pages that are made on the way: public names, pictures of the gallery, the first page."""
    pages.make()
    app.connect("source-read", pages.read)
    app.connect("build-finished", pages.finish)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
