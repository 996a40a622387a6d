"""The windows: a web page that watches snapshots and answers with actions.

    engine.snapshots ──► pump (30 Hz) ──► views.update(snapshot) ──► browsers
    browsers ──► one-line callbacks ──► engine.post(action)

A view owns its handles: they are built once, `update` only assigns. Nothing here decides
anything about the arm, and nothing but this room imports viser.
"""
