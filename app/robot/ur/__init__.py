"""A real UR arm: the driver, what its states mean in words, and a virtual controller."""
