"""Settings of the documentation: `sphinx-build -W -n -b html docs target/docs`, with or without a network."""

import sys
from pathlib import Path

import memo

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "extensions"))

project = "memo"
author = "The memo developers"
project_copyright = author
version = release = memo.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "compiled_signatures",
    "mathml",
    "written_pages",
]
exclude_patterns = ["extensions"]
default_role = "code"
nitpicky = True
# Types of Python, numpy and the extras: their documentation is elsewhere, and this site needs no network.
nitpick_ignore_regex = [
    (r"py:.*", r"(Any|Path|PathLike|Callable|Iterable|Iterator|Mapping|Sequence|ContextManager)"),
    (  # of the inside
        r"py:.*",
        r"memo\.(.*\._\w+|batch\.manifest\.Manifest|keypoints\.points\.Source)",
    ),
    (
        r"py:.*",
        r"(av|collections|concurrent|contextlib|datetime|matplotlib|np|npt|numpy|os|pandas|pathlib|typing|Axes|Figure)(\..*)?",
    ),
    (r"py:.*", r"(Array|Whole|Column|Columns|Luma|NDArray|float64|uint8|bool_|int64|optional|TypeAlias)"),
]

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
myst_dmath_double_inline = True
html_math_renderer = "mathml"

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 88

copybutton_prompt_text = "$ "

sphinx_gallery_conf = {
    "examples_dirs": str(HERE.parent / "examples"),
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    "capture_repr": (),
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,  # their page would fetch scripts from elsewhere
}

html_theme = "furo"
html_title = f"memo {release}"
html_static_path = ["static"]
html_css_files = ["memo.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
