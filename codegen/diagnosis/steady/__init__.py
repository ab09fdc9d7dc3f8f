"""Diagnosis of records at one steady speed each, in place of free runs: each record is one observation."""
