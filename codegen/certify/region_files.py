"""The names of the files that hold proofs region by region."""

REGION_PROOFS = (
    "sliding.json",
    "sliding_limit.json",
    "presliding.json",
    "presliding_back.json",
    "weak.json",
    "passing.json",
    "recovery.json",
)
