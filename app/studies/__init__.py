"""What we learn: true distances, headless runs, benchmarks and their reports."""
