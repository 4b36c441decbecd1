"""Stage 3: object and hand together."""
