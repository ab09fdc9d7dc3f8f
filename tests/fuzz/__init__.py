"""Damaged specs, logs, robot files and certificates: a result or one clear error, nothing else."""
