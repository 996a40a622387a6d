"""What surrounds the scene: one panel a concern, each with `update(snapshot)`."""
