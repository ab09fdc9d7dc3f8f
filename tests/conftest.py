"""Property tests draw the same cases in `make test`, and new ones in `make check-all` (HYPOTHESIS_PROFILE=random)."""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True)
settings.register_profile("random", derandomize=False)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))
