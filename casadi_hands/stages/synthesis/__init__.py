"""Stage 2: fingers for a floating motion, and Algorithm 1, which grows and recombines them."""
