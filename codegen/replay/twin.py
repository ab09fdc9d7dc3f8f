"""Import a generated Python twin from its source."""

from __future__ import annotations

import importlib.util
import tempfile
from pathlib import Path
from types import ModuleType


def load_twin(source: str, name: str) -> ModuleType:
    """The module that a generated ``__init__.py`` is."""
    with tempfile.TemporaryDirectory(prefix="stiction-") as folder:
        path = Path(folder) / f"{name}.py"
        path.write_text(source, encoding="utf-8")
        found = importlib.util.spec_from_file_location(name, path)
        if found is None or found.loader is None:
            raise ImportError(f"the twin {name} cannot be loaded")
        module = importlib.util.module_from_spec(found)
        found.loader.exec_module(module)
    return module
