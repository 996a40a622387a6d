"""The benchmark: a fixed list of scenes, seeds and errors, and every controller in all of them."""
