"""Where a model fails, and how much force it lacks there."""
