"""Candidate effects in rounds of forward selection: fitted, ranked, and tested again once others are included."""
