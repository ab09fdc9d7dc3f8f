"""The observer on an emulated Cortex-M4: its outputs, its size and the instructions that it takes."""

from .image import Figures, emulate, figures, missing_tools

__all__ = ["Figures", "emulate", "figures", "missing_tools"]
