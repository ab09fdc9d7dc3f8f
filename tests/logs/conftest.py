"""The spec that most of these tests read logs for."""

from __future__ import annotations

from pathlib import Path

import pytest
from slider_log import TEXT

from codegen.spec.model import Spec
from codegen.spec.reader import parse_spec


@pytest.fixture
def spec() -> Spec:
    return parse_spec(TEXT, Path("slider.yaml"))
