"""Stage 4: the same motion with physics, contact and clearance as constraints."""
