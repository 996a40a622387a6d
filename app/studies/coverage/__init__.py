"""`flinch coverage`: what a skin sees, over postures, with files to keep."""
