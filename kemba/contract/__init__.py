"""What every effect promises, as checks that anyone can run on an effect of their own."""

from kemba.contract.cases import Broken
from kemba.contract.check import CHECKS, Check, CheckResult, examine

__all__ = ["CHECKS", "Broken", "Check", "CheckResult", "examine"]
