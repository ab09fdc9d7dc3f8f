"""Analysis of an observer: error dynamics, Routh–Hurwitz and Jury conditions, operating points, feasible gains."""
