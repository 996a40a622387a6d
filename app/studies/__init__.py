"""What we learn by running the arm without its page: one run, a trade-off, random worlds."""
