"""What rows say of a set of hypotheses: its evidence, its numbers, and how far it can be trusted."""
