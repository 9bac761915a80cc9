"""What small changes of a task or a machine do: to the same commands, and to the plan made anew."""

from kemba.sensitivity.table import FigureStep, Sensitivity, figures, sensitivity, write_sensitivity

__all__ = ["FigureStep", "Sensitivity", "figures", "sensitivity", "write_sensitivity"]
