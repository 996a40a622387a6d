"""Other packages at the same work, each at its best: one file a peer, or a kind of work."""
