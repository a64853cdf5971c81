"""Rules of the code: order of imports, small files and functions, no hidden errors."""

import ast
import builtins
import functools
import symtable
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "bayes_placement"

# A room imports from the rooms before it, never from those after it; all use the shared modules.
ROOMS = (
    *("positions", "modes", "laws", "effects", "experiment", "inference", "criticism", "design"),
    *("io", "page", "plots", "explorer", "cli"),
)
MOST_AT_ROOT = 4
LINES, FUNCTION_LINES = 400, 50
COMPILING = {"jit", "filter_jit", "pmap", "filter_pmap"}
FORBIDDEN = {"hasattr", "super", "print"}
BUILTINS = {*dir(builtins), "__file__", "__path__"}


@functools.cache
def trees() -> dict[Path, ast.Module]:
    return {path: ast.parse(path.read_text()) for path in sorted(PACKAGE.rglob("*.py"))}


def name(path: Path) -> str:
    return str(path.relative_to(PACKAGE))


def room(path: Path) -> str:
    """First folder of a file, or its own name where it lies at the root."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_rooms(path: Path) -> Iterator[str]:
    """Rooms and shared modules that a file imports, also inside its functions."""
    for node in ast.walk(trees()[path]):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.relative_to(PACKAGE).parts[: -node.level]
            module = [*folder, *(node.module.split(".") if node.module else [])]
            yield from [module[0]] if module else [alias.name for alias in node.names]


def module_exists(folder: Path, name: str) -> bool:
    place = folder.joinpath(*name.split(".")) if name else folder
    return place.with_suffix(".py").is_file() or (place / "__init__.py").is_file()


def test_modules_that_are_imported_exist():
    # mypy takes a module of this package that is gone for one without types.
    offenders = [
        f"{name(path)}, line {node.lineno}: {node.module}"
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.level
        if not module_exists(path.parents[node.level - 1], node.module or "")
    ]
    assert not offenders


def test_the_package_consists_of_these_rooms():
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir()} - {"__pycache__"}
    assert folders == {"_shared", *ROOMS}
    files = {path.stem for path in PACKAGE.glob("*.py")}
    assert files == {"__init__", "__main__"}
    assert len([path for path in PACKAGE.iterdir() if path.is_file()]) <= MOST_AT_ROOT


def test_imports_go_one_way_between_rooms():
    order = ["_shared", *ROOMS]
    offenders = [
        f"{name(path)} imports {other}"
        for path in trees()
        if room(path) not in ("__init__", "__main__")
        for other in imported_rooms(path)
        if other != room(path)
        and (other not in order or order.index(other) > order.index(room(path)))
    ]
    assert not offenders, "a room must not know of the rooms after it"


def test_imports_of_the_package_are_relative():
    offenders = [
        f"{name(path)}, line {node.lineno}"
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if (isinstance(node, ast.ImportFrom) and (node.module or "").startswith("bayes_placement"))
        or (
            isinstance(node, ast.Import)
            and any(alias.name.startswith("bayes_placement") for alias in node.names)
        )
    ]
    assert not offenders


def test_every_file_says_what_it_holds():
    offenders = [name(path) for path, tree in trees().items() if not ast.get_docstring(tree)]
    assert not offenders


def test_files_stay_small():
    lengths = {name(path): len(path.read_text().splitlines()) for path in trees()}
    offenders = {file: length for file, length in lengths.items() if length > LINES}
    assert not offenders, f"split what is longer than {LINES} lines"


def functions(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Names of functions and their lines of code, docstrings not counted."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            words = len((ast.get_docstring(node) or "").splitlines())
            yield node.name, (node.end_lineno or node.lineno) - node.lineno + 1 - words


def test_functions_stay_small():
    offenders = [
        f"{name(path)}: {function} has {size} lines"
        for path, tree in trees().items()
        for function, size in functions(tree)
        if size > FUNCTION_LINES
    ]
    assert not offenders, f"split what is longer than {FUNCTION_LINES} lines"


def test_most_functions_have_fewer_than_ten_lines():
    sizes = sorted(size for tree in trees().values() for _, size in functions(tree))
    assert sizes[len(sizes) // 2] < 10


def test_nothing_hides_trouble():
    offenders = [
        f"{name(path)}, line {node.lineno}"
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if (isinstance(node, ast.ExceptHandler) and node.type is None)
        or (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in FORBIDDEN
        )
    ]
    assert not offenders, f"no bare except, none of {', '.join(sorted(FORBIDDEN))}"


def test_functions_are_compiled_by_the_helper_alone():
    # Numbers are inputs there; a function that is compiled on its own is compiled at every call.
    offenders = [
        f"{name(path)}, line {node.lineno}"
        for path, tree in trees().items()
        for node in ast.walk(tree)
        if name(path) != "_shared/compiled.py"
        if (isinstance(node, ast.Attribute) and node.attr in COMPILING)
        or (isinstance(node, ast.ImportFrom) and COMPILING & {alias.name for alias in node.names})
    ]
    assert not offenders, "use compiled(function)(tree, ...) of _shared/compiled.py"


def names_of_scopes(scope: symtable.SymbolTable) -> Iterator[str]:
    """Names that a scope and those inside it take from the module."""
    yield from (symbol.get_name() for symbol in scope.get_symbols() if symbol.is_global())
    for inner in scope.get_children():
        yield from names_of_scopes(inner)


def names_in_strings(tree: ast.AST) -> Iterator[str]:
    """Names in annotations that are strings; shapes of jaxtyping have no capital letter."""
    for node in ast.walk(tree):
        annotation = getattr(node, "annotation", None) or getattr(node, "returns", None)
        for part in ast.walk(annotation) if isinstance(annotation, ast.AST) else ():
            text = part.value if isinstance(part, ast.Constant) else None
            if isinstance(text, str) and any(map(str.isupper, text)):
                inner = ast.walk(ast.parse(text))
                yield from (child.id for child in inner if isinstance(child, ast.Name))


def test_names_are_defined():
    # ruff and mypy are not asked: they take the shapes of jaxtyping, which are strings, for names.
    offenders = []
    for path, tree in trees().items():
        module = symtable.symtable(path.read_text(), str(path), "exec")
        defined = {symbol.get_name() for symbol in module.get_symbols() if symbol.is_local()}
        used = {*names_of_scopes(module), *names_in_strings(tree)}
        offenders += [f"{name(path)}: {word}" for word in sorted(used - defined - BUILTINS)]
    assert not offenders


# Names that two classes share because users write both, each with the module before it.
def test_the_name_of_a_class_stands_for_one_class():
    places: dict[str, list[str]] = {}
    for path, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(f"{name(path)}, line {node.lineno}")
    shared = {word: files for word, files in places.items() if len(files) > 1}
    assert not shared, "rename one"


def test_names_in_plots_say_what_they_hold():
    # `found` or `told` may be anything; what is drawn is an unknown, a row, a panel.
    participles = {"found", "told", "given", "held", "kept"}
    offenders = [
        f"{name(path)}, line {node.lineno}: {word}"
        for path, tree in trees().items()
        if room(path) == "plots"
        for node in ast.walk(tree)
        for word in [getattr(node, "id", getattr(node, "arg", None))]
        if isinstance(node, ast.Name | ast.arg) and word in participles
    ]
    assert not offenders
