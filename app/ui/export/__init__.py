"""A run as one page to keep or to mail: the scene of the live page, charts, and no server.

    snapshots ──► Film (the page's own views, recorded by viser) ──┐
              └─► Curves (distances, activation, marks)            ├─► document ──► FILE.html
    static_assets/export (layout, player) ─────────────────────────┘

Nothing is drawn a second time, and what plays it is viser's own viewer, asked by our player.
"""
