"""Experiments that discriminate between effects that one log cannot tell apart."""
