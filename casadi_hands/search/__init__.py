"""Algorithm 1: add joints, reseed, recombine; and where the work runs."""
