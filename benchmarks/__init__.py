"""Measured speed, with a peer in the same run; figures are ratios, since machines are shared and noisy."""
