"""Runs kept as evidence: what entered every tick, without loss, and a witness of what came out."""
