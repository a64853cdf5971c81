"""Universal files typed by hand, for the tests of what is read from them."""


def typed(folder, text, *changes):
    """Write a text to a file; each change is a pair of what stands in it and what is to."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "typed.uff"
    path.write_text(text)
    return path
