"""What was recorded, once more: recomputed, stepped through, verified, compared.

    recording ─► Inputs of any tick ─► the brain that was ─► Outputs, to the last bit
                                   └─► another brain ─► what it would have done

Nothing here reaches an arm or a sensor.
"""
