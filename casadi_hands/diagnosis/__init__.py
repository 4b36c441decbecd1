"""Why something failed: findings, and the sentences that tell them."""
