"""Folders of templates and shipped specs: next to the package in a source tree, inside it in a wheel."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]
"""Folder of the package ``codegen``."""


def resource_folder(name: str) -> Path:
    """The folder ``templates`` or ``specs``. Raises FileNotFoundError if the installation is incomplete."""
    for folder in (_PACKAGE / "shipped" / name, _PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"the folder {name} is missing from this installation of stiction")
