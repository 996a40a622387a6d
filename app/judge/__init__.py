"""Slow and exact answers to judge fast ones by; they share no code with what they judge."""
