"""The modules of ``codegen/`` as a graph of imports, read and not run: no cycle, and one direction of the folders."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ARCHITECTURE = ROOT / "docs" / "architecture.md"
Graph = Mapping[str, frozenset[str]]


def imported(text: str, modules: Iterable[str]) -> frozenset[str]:
    """The modules that a file imports anywhere in it, for its types or in a function too."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            assert node.level == 0, "imports in codegen/ name their module in full"
            whole = {f"{node.module}.{name.name}" for name in node.names}
            found |= {name if name in modules else node.module for name in whole}
        elif isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
    return frozenset(found & set(modules))


def graph_of(package: Path) -> Graph:
    """Module → the modules of the same package that it imports."""
    names = {path.relative_to(package.parent).with_suffix(""): path for path in package.rglob("*.py")}
    files = {".".join(name.parts).removesuffix(".__init__"): path for name, path in names.items()}
    return {name: imported(path.read_text("utf-8"), files) - {name} for name, path in files.items()}


def folder(module: str, inside: str = "codegen") -> str:
    """The folder (or file) of a package that a module lies in; "" outside the package."""
    return module.removeprefix(f"{inside}.").split(".")[0] if module.startswith(f"{inside}.") else ""


def between_folders(graph: Graph) -> Graph:
    """Folder → the other folders that its modules import."""
    return {
        own: frozenset(folder(b) for a, into in graph.items() if folder(a) == own for b in into) - {own}
        for own in {folder(module) for module in graph} - {""}
    }


def cycle(graph: Graph) -> list[str]:
    """The modules of a cycle; [] where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def stated_order(begin: str) -> list[str]:
    """The folders as a line of docs/architecture.md that begins so lists them, the first of the line first."""
    line = re.search(rf"^{re.escape(begin)}(.*)\.$", ARCHITECTURE.read_text("utf-8"), re.MULTILINE)
    assert line is not None
    return re.findall(r"`(\w+)/`", line[1])


def backward(graph: Graph, order: list[str], inside: str = "codegen") -> set[str]:
    """The imports by a module in one of these folders of a module in a later one."""
    places = {name: place for place, name in enumerate(order)}
    at = {module: places.get(folder(module, inside), -1) for module in graph}
    return {f"{a} -> {b}" for a, into in graph.items() for b in into if 0 <= at[a] < at[b]}


@pytest.fixture(scope="module")
def graph() -> Graph:
    return graph_of(ROOT / "codegen")


def test_no_module_imports_itself_by_others(graph: Graph) -> None:
    assert cycle(graph) == []


def test_no_folder_imports_itself_by_others(graph: Graph) -> None:
    assert cycle(between_folders(graph)) == []


def test_no_folder_imports_one_later_in_the_line(graph: Graph) -> None:
    order, folders = stated_order("A folder imports only those before it: "), between_folders(graph)
    assert sorted(order) == sorted(folders), "docs/architecture.md lists other folders than there are"
    assert backward(graph, order) == set()


def test_no_stage_of_the_diagnosis_imports_a_later_one(graph: Graph) -> None:
    """Files beside the stages hold what all of them use, or use all of them."""
    order, inside = stated_order("Inside `diagnosis/` likewise: "), "codegen.diagnosis"
    stages = (ROOT / "codegen" / "diagnosis").glob("*/__init__.py")
    assert sorted(order) == sorted(path.parent.name for path in stages)
    assert backward(graph, order, inside) == set()
    assert backward(graph, order[::-1], inside) != set()


def test_the_thesis_is_imported_by_the_app_alone(graph: Graph) -> None:
    assert {own for own, into in between_folders(graph).items() if "thesis" in into} <= {"app"}


def test_the_checker_imports_nothing_of_the_project(graph: Graph) -> None:
    assert between_folders(graph)["checker"] == frozenset()


def test_cycles_are_seen_wherever_the_import_stands(tmp_path: Path) -> None:
    """Under TYPE_CHECKING, in a function, of a name of a module or of the module itself."""
    package = tmp_path / "codegen"
    texts = {
        "a/__init__.py": "",
        "a/one.py": "if False:\n    from codegen.b.two import Name\n",
        "b/__init__.py": "",
        "b/two.py": "def f():\n    from codegen.b import three\n",
        "b/three.py": "import codegen.a.one\n",
    }
    for name, text in texts.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text)
    graph = graph_of(package)
    assert set(cycle(graph)) == {"codegen.a.one", "codegen.b.two", "codegen.b.three"}
    assert set(cycle(between_folders(graph))) == {"a", "b"}
    (package / "b" / "three.py").write_text("import codegen.a\n")
    assert cycle(graph_of(package)) == []
