"""Tests of the plants: closed forms, independent integrators and the practice logs."""
