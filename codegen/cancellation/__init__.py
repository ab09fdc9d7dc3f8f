"""Friction cancellation (chapter 5 of the thesis): which friction the inputs can cancel, and the input that does it."""

from codegen.cancellation.law import cancelling_outputs, with_cancellation
from codegen.cancellation.plan import Plan, RankFalls, make_plan
from codegen.cancellation.reach import Reach, Verdict, reach

__all__ = ["Plan", "RankFalls", "Reach", "Verdict", "cancelling_outputs", "make_plan", "reach", "with_cancellation"]
