"""Search for certificates, for error bounds in newtons and for remedies after a refusal.

All of it is a proposal; only what the checker (`checker/`) accepts is issued.
"""

REGION_PROOFS = ("sliding.json", "sliding_limit.json", "presliding.json", "weak.json", "passing.json", "recovery.json")
"""Names of the proof files for the regions of the envelope of a refused DFO."""
