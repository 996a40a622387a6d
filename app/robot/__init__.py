"""Who we are: model, posture, meshes, skin layout, drivers."""
