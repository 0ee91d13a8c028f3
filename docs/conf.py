# SPDX-License-Identifier: MIT
"""Settings of the documentation site, which script/site builds."""

import logging
import sys
from pathlib import Path

import ehsid

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

from repository_links import without_file

project = "ehsid"
author = "the authors of ehsid"
version = release = ehsid.__version__

extensions = [
    "breathe",
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_design",
    # of docs/extensions
    "commands",
    "compiled_signatures",
    "headers",
    "mathml",
    "repository_files",
    "repository_links",
    "schemas",
    "widths",
]
exclude_patterns = ["extensions", *without_file()]
smartquotes = False  # they make of two hyphens, as in --out, a dash
default_role = "code"  # of words in single backquotes in a docstring
highlight_language = "none"  # a block of code says what it is

# A list of pages by a pattern may be empty, which Sphinx warns of under no name.
logging.getLogger("sphinx.sphinx.directives.other").addFilter(
    lambda record: "glob pattern" not in record.msg
)

# Pages
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
myst_links_external_new_tab = False
nb_execution_mode = "off"  # notebooks are stored with their results, and run by their test

# Python
autodoc_default_options = {"members": True, "undoc-members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_class_signature = "mixed"
autodoc_type_aliases = {  # stay as they are; the page says what they stand for
    "npt.ArrayLike": "ArrayLike",
    "Arrays": "Arrays",
    "RigSource": "RigSource",
    "Source": "Source",
}
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_param = False  # types in docstrings are words; they are no names to look for
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88

# C++ and C; headers.py runs Doxygen and tells Breathe where its result is
breathe_default_project = "ehsid"
breathe_projects = {"ehsid": ""}
breathe_domain_by_extension = {"h": "c", "hpp": "cpp"}
breathe_show_include = False

nitpick_ignore_regex = [
    # Types in declarations, which the compilers check. Template parameters and types of Eigen have
    # no page.
    ("cpp:identifier", ".*"),
    ("c:identifier", ".*"),
    # Types of other packages, which are on sites of their own, and words such as "int in 1..6".
    ("py:class", ".*"),
]

toc_object_entries_show_parents = "hide"

html_theme = "pydata_sphinx_theme"
html_title = "ehsid"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_context = {"default_mode": "auto"}
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False  # a browser lets no page of files read another one
# A page without others below it has nothing to list.
FRONT = (
    "readme",
    "tutorials/my_rig_in_twenty_minutes",
    "tutorials/estimator_on_my_controller",
    "choose",
    "cost",
)
html_sidebars: dict[str, list[str]] = {page: [] for page in FRONT}
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 7,  # all sections: none goes into a menu "More"
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_center": [],
    "footer_end": [],
    "show_prev_next": True,
    "back_to_top_button": False,
}
project_copyright = "the authors of ehsid, MIT licence"
copybutton_prompt_text = "$ "
copybutton_line_continuation_character = "\\"
