"""Stage 1: the object moved by disembodied contacts."""
