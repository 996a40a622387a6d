"""What the brain moves and sees through: simulated, real, mixed or recorded, all alike."""
