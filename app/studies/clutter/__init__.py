"""Narrow places for an arm to reach into: our own, which a seed makes, and MotionBenchMaker's."""
