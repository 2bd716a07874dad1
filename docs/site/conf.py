"""Sphinx configuration of the documentation site; `build.py` lays out the sources and runs Sphinx on them."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "awiwi_gen"
author = "the authors of awiwi_gen"
extensions = ["myst_parser", "sphinx_gallery.gen_gallery", "mathml"]
exclude_patterns = ["gallery_scripts"]
html_theme = "furo"
html_title = "awiwi_gen"
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_static_path = [str(Path(__file__).resolve().parents[2] / "build/site-sources/_static")]
html_css_files = ["site.css"]
html_theme_options = {"navigation_with_keys": True}
html_math_renderer = "mathml"  # browsers draw it themselves: no script, no network
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
suppress_warnings = ["config.cache", "misc.highlighting_failure"]
highlight_language = "text"
nitpicky = True
sphinx_gallery_conf = {
    "examples_dirs": "gallery_scripts",
    "gallery_dirs": "gallery",
    "filename_pattern": ".*",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "abort_on_example_error": True,
    "matplotlib_animations": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
}
