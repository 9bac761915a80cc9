"""Why a task has no plan: checks before solving, and what gives way in an elastic solve."""
