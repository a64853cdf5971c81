"""Pages of the reference, with what has a line in a registry and no section of its own."""

from bayes_placement.io.formats import FORMATS

SECTION = """
## `bp.io.{module}`

```{{eval-rst}}
.. automodule:: bayes_placement.io.{module}
```
"""


def with_registered(page, text):
    """Text of a page by its name; that on files has a section for each reader of a format."""
    if page != "io":
        return text
    modules = dict.fromkeys(known.reader.split(".")[0] for known in FORMATS)
    missing = [name for name in modules if f"automodule:: bayes_placement.io.{name}\n" not in text]
    return text + "".join(SECTION.format(module=module) for module in missing)
