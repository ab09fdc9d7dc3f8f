"""Certificates, bounds in newtons and what to change after a refusal: searched here, accepted by `checker/` alone."""

REGION_PROOFS = (
    "sliding.json",
    "sliding_limit.json",
    "presliding.json",
    "weak.json",
    "passing.json",
    "recovery.json",
)
"""Files that hold proofs of a refused DFO region by region."""
