"""Controllers that others bring, each a file of their own: `static_assets/benchmark` shows how."""
