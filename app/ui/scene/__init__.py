"""The 3D scene: one view a thing to see."""
