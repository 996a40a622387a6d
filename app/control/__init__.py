"""What to do: goals, task priority, limits, supervisor."""
