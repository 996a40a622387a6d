"""Where frames come from: simulated sensors and recordings."""
