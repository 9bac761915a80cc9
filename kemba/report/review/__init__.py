"""The page after a jump: plan, simulated robot and measured runs on one sheet, with a verdict."""
