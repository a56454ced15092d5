"""Settings of Sphinx for the documentation site. `docs/site/build.py` prepares the pages and calls it."""

project = "harness"
author = "The harness authors"
extensions = ["myst_parser", "sphinxcontrib.mermaid"]
html_theme = "furo"
html_title = "harness"
html_show_sourcelink = False
html_show_sphinx = False
html_copy_source = False
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
myst_fence_as_directive = ["mermaid"]
suppress_warnings = [
    "myst.header",  # the README leaves out levels of headings
    "misc.highlighting_failure",  # blocks with ellipses are no valid TOML
]
