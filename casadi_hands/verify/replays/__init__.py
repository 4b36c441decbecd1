"""The design played by physics engines, as planned and perturbed."""
