"""What a motion should do: tasks, their requirements, costs and options."""
