"""From a log and a spec to the effect that the spec lacks; ``diagnose.py`` runs the stages in order.

``fit/`` simulates and fits models, ``evidence/`` compares them, ``selection/`` adds effects while the evidence asks for
them, and ``verdict/`` states the answer.
"""
