"""The site: notebooks, pages of this folder, docstrings.

sphinx-build -W -j 2 -c notebooks/docs notebooks build/site
"""

import importlib.metadata
import re
import sys
from pathlib import Path

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util.math import get_node_equation_number

sys.path.insert(0, str(Path(__file__).parent))
from reference_pages import with_registered

project = "bayes_placement"
author = "the bayes_placement developers"
copyright = f"2026, {author}"
version = release = importlib.metadata.version("bayes_placement")

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
default_role = "literal"  # docstrings write `noise` for code
exclude_patterns = ["**/.ipynb_checkpoints"]

html_theme = "pydata_sphinx_theme"
html_title = "bayes_placement"
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_sidebars = {
    page: []
    for page in ("index", "docs/gallery/index", "docs/glossary", "docs/method", "docs/search")
}
html_context = {"default_mode": "auto"}
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "show_toc_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
toc_object_entries_show_parents = "hide"
maximum_signature_line_length = 80
pygments_dark_style = "github-dark"

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "off"  # notebooks are stored as they ran
nb_output_stderr = "remove"  # bars of progress
nb_merge_streams = True

suppress_warnings = ["ref.python"]  # signatures of overloads name `Modal` without its module
add_module_names = False  # the heading says which namespace it is
autodoc_default_options = {"members": True, "member-order": "bysource", "no-value": True}
autodoc_preserve_defaults = True
autodoc_typehints_format = "short"
autodoc_class_signature = "mixed"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_attr_annotations = False  # signatures have the shapes

MARKUP = re.compile(r"(`+[^`]*`+)|([|*]|\b_(?=\W|$))")
"""Code, or characters that reStructuredText takes for markup: |H|, a * b."""


def plain_text(app, what, name, obj, options, lines):
    """Docstrings are plain text with code in backticks, and examples as they are typed."""
    typed = False  # from a prompt on, to the next empty line
    for number, line in enumerate(lines):
        typed = bool(line) and (typed or line.startswith(">>> "))
        if not typed:
            lines[number] = MARKUP.sub(lambda m: m[1] or "\\" + m[2], line)


SHORT = {
    r"float \| int \| ~?[\w.]*Array \| ~?numpy\.ndarray \| ~?[\w.]*Distribution": "Parameter",
    r"jaxlib\._jax\.": "",
}
"""Words of annotations by what a reader knows."""


def short_words(app, what, name, obj, options, signature, returned):
    """A number, an array or a distribution is a parameter; a constant is its value."""
    for long, short in SHORT.items():
        signature, returned = (text and re.sub(long, short, text) for text in (signature, returned))
    known = vars(sys.modules[obj.__module__]) if hasattr(obj, "__module__") else {}

    def value(constant):
        return f"= {known[constant[1]]!r}" if constant[1] in known else constant[0]

    return signature and re.sub(r"= ([A-Z_]{3,})\b", value, signature), returned


def prepared(app, docname, source):
    """Pages whose content is in the package."""
    if docname == "docs/reference/effects":
        call_by_public_names()
    folder, _, page = docname.rpartition("/")
    if folder == "docs/reference":
        source[0] = with_registered(page, source[0])
    if docname == "docs/reference/cli":
        source[0] += commands()


def call_by_public_names():
    """Effects are called by the names of the registry, which differ from those of their classes."""
    from bayes_placement.effects import EFFECTS

    for word, effect in EFFECTS.items():
        effect.__name__ = effect.__qualname__ = word


def commands():
    """What `--help` says of each command."""
    from typer.main import get_command

    from bayes_placement.cli.app import app

    group = get_command(app)
    parts = [group.help]
    for name, command in group.commands.items():
        arguments = [p for p in command.params if p.param_type_name == "argument"]
        usage = " ".join(["bayes-placement", name, *(p.name.upper() for p in arguments)])
        options = [p for p in command.params if p.param_type_name == "option"]
        named = [(p.name.upper(), p) for p in arguments] + [(p.opts[0], p) for p in options]
        listed = "\n\n".join(f"`{word}`\n: {p.help}" for word, p in named)
        below = command.epilog or ""
        parts.append(f"## `{name}`\n\n{command.help}\n\n    {usage}\n\n{listed}\n\n{below}")
    return "\n\n" + "\n\n".join(parts) + "\n"


def without_fields(app, what, name, obj, skip, options):
    """Fields of a class are described with its parameters."""
    return True if obj is None or type(obj).__name__ == "_tuplegetter" else None


def visit_math(translator, node):
    """MathML, which browsers draw without a script from the network."""
    translator.body.append(tex2mathml(node.astext()))
    raise SkipNode


def visit_displayed_math(translator, node):
    """The same on a line of its own, with its number."""
    translator.body.append(translator.starttag(node, "div", CLASS="math-block"))
    if node["number"]:
        number = get_node_equation_number(translator, node)
        translator.body.append(f'<span class="eqno">({number})')
        translator.add_permalink_ref(node, "Link to this equation")
        translator.body.append("</span>")
    translator.body.append(tex2mathml(node.astext(), as_block=True) + "</div>\n")
    raise SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_displayed_math, None))
    app.connect("autodoc-process-docstring", plain_text, priority=100)  # before napoleon
    app.connect("autodoc-process-signature", short_words)
    app.connect("autodoc-skip-member", without_fields)
    app.connect("source-read", prepared)
