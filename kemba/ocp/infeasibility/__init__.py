"""Why a task has no plan: checks before solving, and what an elastic solve violates."""
