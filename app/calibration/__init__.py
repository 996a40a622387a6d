"""Where sensors really sit, how their ranges and stamps err: from what they saw of known things."""
