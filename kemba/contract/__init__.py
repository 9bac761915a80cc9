"""What every effect promises, as checks that anyone can run on an effect of their own."""

from kemba.contract.check import CHECKS, Broken, Check, CheckResult, examine

__all__ = ["CHECKS", "Broken", "Check", "CheckResult", "examine"]
