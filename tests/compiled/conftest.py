"""One workshop of compiled objects for the whole session, shared by pytest-xdist's workers."""

from __future__ import annotations

import os

import pytest

from .toolchain import Workshop


@pytest.fixture(scope="session")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    return Workshop(shared / "workshop")
